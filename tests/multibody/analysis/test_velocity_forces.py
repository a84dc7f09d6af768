"""Forces by velocities against the change of the mass matrix, and against friction."""

import numpy as np
import pytest
from calmotion.model import Rotor
from calmotion.multibody import WORLD, Mechanism, VelocityForces, rigid_poses
from scipy.spatial.transform import Rotation

VALUES, RATES = np.array([0.3, -0.8]), np.array([1.7, -2.3])


def _arm(model, rotor=None):
    """Two links that turn about y and then about z, so that all Coriolis terms are there."""
    arm = Mechanism(gravity=(0.0, 0.0, -9.81))
    upper = arm.body("upper", 1.2, center=(0.25, 0.02, 0), inertia=(0.001, 0.03, 0.03))
    fore = arm.body("fore", 0.8, center=(0.2, 0, 0.01), inertia=(0.001, 0.012, 0.012), position=(0.5, 0, 0))
    shoulder = arm.joint("revolute", WORLD, upper, position=(0, 0, 0), axis=(0, -1, 0))
    elbow = arm.joint("revolute", upper, fore, position=(0.5, 0, 0), axis=(0, 0, 1))
    for joint in (shoulder, elbow):
        arm.motor(joint, model=model, position_gain=100.0, velocity_gain=3.0, rotor=rotor)
    return arm.compile()


def _motion(model, values, rates):
    """Velocities of the bodies in their own axes, shape [12], by differences of poses."""
    h = 1e-5
    c, q = rigid_poses(model, model.joint_angles(np.stack([values - h * rates, values, values + h * rates])))
    own = [Rotation.from_quat(rows, scalar_first=True) for rows in q]
    turns = [(own[1].inv() * ahead).as_rotvec() for ahead in (own[2], own[0])]
    linear = own[1].inv().apply((c[2] - c[0]) / (2.0 * h))
    return np.concatenate([linear, (turns[0] - turns[1]) / (2.0 * h)], axis=1).ravel()


def _energy(model, values, rates):
    """Kinetic energy, from the inertia of the bodies about their origins."""
    system, v = model.system, _motion(model, values, rates).reshape(-1, 6)
    found = 0.0
    for b, (linear, turn) in enumerate(zip(v[:, :3], v[:, 3:], strict=True)):
        inertia = np.trace(system.Z[b]) * np.eye(3) - system.Z[b]
        found += 0.5 * system.mass[b] * linear @ linear + linear @ np.cross(turn, system.s[b])
        found += 0.5 * turn @ inertia @ turn
    return found


def test_their_power_is_the_change_of_kinetic_energy_at_constant_rates():
    model, h = _arm("prescribed"), 1e-4
    forces = VelocityForces(model)
    assert forces.known
    power = forces.at(VALUES, RATES) @ _motion(model, VALUES, RATES)
    change = (_energy(model, VALUES + h * RATES, RATES) - _energy(model, VALUES - h * RATES, RATES)) / (2.0 * h)
    assert abs(change) > 0.1
    assert power == pytest.approx(change, rel=1e-4)


def test_they_are_quadratic_in_the_rates_and_hold_friction_but_no_gains():
    rotor = Rotor(armature=0.01, viscous_friction=0.7, friction=0.2)
    without, with_friction = (VelocityForces(_arm(*case)) for case in (("prescribed",), ("servo", rotor)))
    np.testing.assert_allclose(without.at(VALUES, 2.0 * RATES), 4.0 * without.at(VALUES, RATES), rtol=1e-3, atol=1e-6)
    found = with_friction.at(VALUES, RATES).reshape(2, 7)
    np.testing.assert_allclose(found[:, 6], 0.2 * np.sign(RATES), atol=1e-6)
    np.testing.assert_allclose(found[:, :6].ravel(), without.at(VALUES, RATES), rtol=1e-6, atol=1e-8)
    assert not np.any(without.at(VALUES, np.zeros(2)))


def test_closed_chains_and_free_joints_are_told():
    arm = Mechanism()
    trolley = arm.body("trolley", 1.0, center=(0, 0, 0), inertia=(0.01, 0.01, 0.01))
    bob = arm.body("bob", 0.5, center=(0, 0, -0.3), inertia=(0.002, 0.002, 0.001))
    arm.motor(arm.joint("prismatic", WORLD, trolley, position=(0, 0, 0), axis=(1, 0, 0)))
    arm.joint("revolute", trolley, bob, position=(0, 0, 0), axis=(0, 1, 0))
    forces = VelocityForces(arm.compile())
    assert not forces.known and not np.any(forces.at(np.zeros(1), np.ones(1)))
