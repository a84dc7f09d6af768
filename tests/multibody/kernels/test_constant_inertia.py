"""Non-rotating bodies: their rows against sums over particles, and against those of rotating bodies."""

import numpy as np
import pytest
from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels import constant_inertia
from calmotion.multibody.kernels.components import ComponentMotion
from calmotion.multibody.kernels.work import allocate_work
from gantries import ASIDE, STILL, UP, drive, gantry
from particles import by_particles, component_of, particle_system

ALL = ("Bridge", "Trolley", "Beam0", "Beam1", "Tool")


def component(r):
    rng = np.random.default_rng(0)
    system, parts = particle_system(rng, [-1], [r])
    u, v, vd = (rng.normal(size=r) * scale for scale in (0.3, 1.0, 2.0))
    a, al = rng.normal(size=(2, 3))
    return system, parts[0], (a, al, u, v, vd)


def residual(system, state):
    a, al, u, v, vd = state
    work, res = allocate_work(system), np.zeros(6 + len(u))
    motion = ComponentMotion(a, np.zeros(3), al, u, v, vd)
    constant_inertia.nonrotating_residual(component_of(system, 0), motion, work, res)
    return res, work


def mass_matrix(system, work):
    r = system.size - 6
    D = np.zeros((6 + r, 6 + r))
    constant_inertia.nonrotating_mass_matrix(component_of(system, 0), work, D)
    return D


@pytest.mark.parametrize("r", [0, 1, 6])
def test_rows_are_the_work_of_the_particles_where_nothing_turns_or_nothing_is_deformed(r):
    system, part, (a, al, u, v, vd) = component(r)
    still = np.zeros(3)
    undeformed = (a, al, 0.0 * u, v, vd)
    expected = by_particles(system, part, (a, still, al, 0.0 * u, v, vd))
    assert np.abs(residual(system, undeformed)[0] - expected).max() < 1e-12 * np.abs(expected).max()
    # deformed: all but what the acceleration of the deformation does to the moment
    expected = by_particles(system, part, (a, still, still, u, v, vd))
    found = residual(system, (a, still, u, v, vd))[0]
    expected[3:6] -= np.einsum("l,k,lki->i", u, vd, system.axial[0])
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("r", [0, 5])
def test_mass_matrix_is_symmetric_and_gives_the_acceleration_terms(r):
    system, _, (a, al, u, v, vd) = component(r)
    found, work = residual(system, (a, al, u, v, vd))
    D = mass_matrix(system, work)
    change = found - residual(system, (0.0 * a, 0.0 * al, u, v, 0.0 * vd))[0]
    assert np.abs(D - D.T).max() < 1e-15
    assert np.abs(D @ np.concatenate([a, al, vd]) - change).max() < 1e-12 * np.abs(change).max()


@pytest.mark.parametrize("r", [0, 1, 6])
def test_jacobians_match_central_differences(r):
    system, _, (a, al, u, v, vd) = component(r)
    n, e = 6 + r, 1e-3
    D = mass_matrix(system, residual(system, (a, al, u, v, vd))[1])
    P, K = np.zeros((n, n)), np.zeros((n, n))
    one, motion = component_of(system, 0), ComponentMotion(a, np.zeros(3), al, u, v, vd)
    constant_inertia.nonrotating_velocity_jacobian(one, P)
    constant_inertia.nonrotating_position_jacobian(one, motion, D, K)

    def change(da=0.0, du=0.0, dv=0.0):
        ends = [residual(system, (a + k * da, al, u + k * du, v + k * dv, vd))[0] for k in (e, -e)]
        return (ends[0] - ends[1]) / (2 * e)

    for k in range(3):
        assert np.abs(change(da=np.cross(a, np.eye(3)[k])) - K[:, 3 + k]).max() < 1e-10
    for k in range(r):
        assert np.abs(change(du=np.eye(r)[k]) - K[:, 6 + k]).max() < 1e-10
        assert np.abs(change(dv=np.eye(r)[k]) - P[:, 6 + k]).max() < 1e-10
    assert not P[:, :6].any() and not K[:, :3].any()


def run(model, reach, steps=150):
    """The motion, where the tool is, shape [T, 3], and the motors' efforts, shape [T, 2]."""
    times = 0.004 * np.arange(steps + 1)
    angles, rates = (model.joint_angles(values) for values in drive(times, reach))
    found = simulate(
        model.system, rigid_state(model, angles[0]), angles, rates, 0.004, Workspace.for_system(model.system)
    )
    tool = target_frames(model, found.states.c, found.states.q, found.states.u)[0][:, 0]
    return found.states, tool, reactions(model.system, found, angles, rates).efforts[:, :2]


def test_non_rotating_frames_are_simulated_without_error():
    """A beam on rigid slides; what hangs on it turns with its tip, and is told so."""
    exact, told = (run(gantry([STILL], non_rotating), 0.2) for non_rotating in ((), ALL[:3]))
    bent = np.abs(exact[0].u).max(axis=(0, 1))
    assert np.abs(exact[0].q[:, -1] - exact[0].q[0, 0]).max() > 1e-3, "the tool does turn"
    assert np.abs(told[0].u - exact[0].u).max() < 1e-12 * bent.max()
    assert np.abs(told[1] - exact[1]).max() < 1e-12 * np.abs(exact[1]).max()
    assert np.abs(told[2] - exact[2]).max() < 1e-10 * np.abs(exact[2]).max()


@pytest.mark.parametrize("beams", [[UP, ASIDE], [STILL, STILL]], ids=["mast and boom", "boom"])
def test_the_error_on_flexible_parents_is_of_second_order(beams):
    """A beam on the end of another one: its frame turns with the deflection. All loads grow together."""
    lost = []
    for part in (1.0, 0.5, 0.25):
        exact, told = (run(gantry(beams, non_rotating, 9.81 * part), 0.2 * part) for non_rotating in ((), ALL))
        lost.append([np.abs(found - expected).max() for found, expected in zip(told[1:], exact[1:], strict=True)])
    orders = np.log2(np.array(lost[:-1]) / lost[1:])
    assert np.all(orders > 1.9), (orders, lost)
    assert lost[0][0] < 1e-3, "[m], of a deflection of 0.2 m"
