"""A planar four-bar of rigid links: three of its constraints are redundant, and it must not matter."""

import numpy as np
import pytest
from calmotion.model import WORLD
from calmotion.multibody.analysis.joint_faults import dead_centres
from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from mechanisms import mechanism

CRANK, COUPLER, ROCKER, GROUND = 0.3, 0.9, 0.7, 0.8  # Grashof: the crank turns all the way


def closure(crank):
    """End of the coupler for crank angles about y (positive turns x down to -z), by the law of cosines."""
    ax, az = CRANK * np.cos(crank), -CRANK * np.sin(crank)
    dx, dz = GROUND - ax, -az
    d = np.hypot(dx, dz)
    along = (COUPLER**2 - ROCKER**2 + d**2) / (2 * d)
    off = np.sqrt(COUPLER**2 - along**2)
    return np.stack([ax + (along * dx - off * dz) / d, az + (along * dz + off * dx) / d], axis=-1)


@pytest.fixture(scope="module")
def turning():
    knee = closure(0.0)
    model = mechanism(
        [(0, 0), (CRANK, 0), tuple(knee), (GROUND, 0)],
        [(0, 1), (1, 2), (3, 2)],
        [(WORLD, 0, 0), (0, 1, 1), (1, 2, 2), (WORLD, 2, 3)],
        driven=[0],
        target=1,
    )
    h = 1.0 / 480.0
    t = h * np.arange(961)
    # two turns and a half, from rest to rest
    s = t / t[-1]
    angle = 5.0 * np.pi * (10 * s**3 - 15 * s**4 + 6 * s**5)
    values = np.zeros((len(t), len(model.system.rows)))
    crank = int(np.flatnonzero(model.motor == 0)[0])
    values[:, crank] = angle
    rates = np.gradient(values, h, axis=0, edge_order=2)
    rates[:, crank] = 5.0 * np.pi * (30 * s**2 - 60 * s**3 + 30 * s**4) / t[-1]
    start = rigid_state(model, np.where(model.motor >= 0, values[0], model.rest_angles))
    run = simulate(model.system, start, values, rates, h, Workspace.for_system(model.system))
    tips = target_frames(model, run.states.c, run.states.q, run.states.u)[0][:, 0]
    return model, angle, tips, run


def test_one_joint_closes_the_chain_and_the_motor_stays_in_the_tree(turning):
    model = turning[0]
    assert len(model.system.rows) == 4 and len(model.system.parent) == 3
    assert model.motor[:3].max() == 0 and model.motor[3] == -1


def test_its_positions_are_unique_through_full_revolutions(turning):
    _, angle, tips, run = turning
    assert np.abs(tips[:, [0, 2]] - closure(angle)).max() < 1e-6
    assert np.abs(tips[:, 1]).max() < 1e-9
    assert run.max_joint_gap < 1e-6
    assert dead_centres(run.margins) == [], "a crank-rocker driven by its crank has none"


def test_redundant_constraints_carry_least_load(turning):
    """Nothing pushes out of the plane, so the multipliers of least norm have no part there."""
    model, _, _, run = turning
    lam = run.states.lam[1:]
    assert np.isfinite(lam).all()
    free = model.system.rows == 5
    out_of_plane = np.abs(lam[:, :, 1]).max()
    moments = np.abs(lam[:, free, 3:5]).max()
    assert max(out_of_plane, moments) < 1e-7 * np.abs(lam).max()


def test_the_motor_s_work_is_the_energy(turning):
    """Power of the motor over the motion against kinetic and potential energy of the bars."""
    model, angle, _, run = turning
    system, states = model.system, run.states
    crank = int(np.flatnonzero(model.motor == 0)[0])
    torque = states.lam[:, crank, 5]
    work = np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle))
    energy = np.zeros(2)
    for n, k in ((0, 0), (-1, 1)):
        for b in range(len(system.parent)):
            q = states.q[n, b]
            R = np.array(
                [
                    [1 - 2 * (q[2] ** 2 + q[3] ** 2), 0, 2 * (q[1] * q[3] + q[0] * q[2])],
                    [0, 1, 0],
                    [2 * (q[1] * q[3] - q[0] * q[2]), 0, 1 - 2 * (q[1] ** 2 + q[2] ** 2)],
                ]
            )
            energy[k] += 9.81 * (system.mass[b] * states.c[n, b] + R @ system.s[b])[2]
    # at rest at both ends
    assert work == pytest.approx(energy[1] - energy[0], rel=2e-3)
