"""The double four-bar of the IFToMM benchmark library: through a pose in which it could branch, once every turn."""

import numpy as np
import pytest
from calmotion.model import WORLD
from calmotion.multibody.analysis.joint_faults import dead_centres
from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from mechanisms import mechanism

# first top corner, (|x|, z) [m], by its equation of motion in one coordinate, theta'' = -(3.5 g / 3) cos theta
EXACT = {4.0: (0.11761610, 0.99305914), 10.0: (0.32845811, 0.94451854)}


def run(step, duration=10.0):
    model = mechanism(
        [(0, 0), (0, 1), (1, 1), (1, 0), (2, 1), (2, 0)],
        [(0, 1), (1, 2), (3, 2), (2, 4), (5, 4)],
        [(WORLD, 0, 0), (0, 1, 1), (1, 2, 2), (WORLD, 2, 3), (2, 3, 2), (3, 4, 4), (WORLD, 4, 5)],
    )
    start = rigid_state(model, model.rest_angles)
    for k, bar in enumerate(model.tree.body):
        if bar in (0, 2, 4):
            start.V[k, 4] = 1.0  # uprights turn about y, which is their own y axis too
        else:
            start.V[k, 0] = 1.0
    count = round(duration / step) + 1
    still = np.zeros((count, len(model.system.rows)))
    motion = simulate(
        model.system, start, still, still, step, Workspace.for_system(model.system), from_equilibrium=False
    )
    states = motion.states
    return target_frames(model, states.c, states.q, states.u)[0][:, 0], motion


def error(tip, step, time):
    at = tip[round(time / step)]
    return float(np.hypot(abs(at[0]) - EXACT[time][0], at[2] - EXACT[time][1]))


def test_it_passes_every_singular_pose_and_converges():
    coarse, _ = run(1 / 200)
    fine, motion = run(1 / 400)
    assert error(fine, 1 / 400, 4.0) < 1e-3 and error(fine, 1 / 400, 10.0) < 6e-3
    for time in EXACT:
        assert error(coarse, 1 / 200, time) > 3.5 * error(fine, 1 / 400, time)  # second order
    assert motion.max_joint_gap < 1e-6
    assert np.isfinite(motion.states.lam).all()
    # all its bars level, twice in each of five turns
    passed = dead_centres(motion.margins)
    assert len(passed) == 10 and np.abs(fine[passed][:, 2]).max() < 0.01


def test_its_energy_stays():
    """What is lost to numerical damping over ten seconds, of the kinetic energy at the start, falls with the step."""
    lost = []
    for step in (1 / 200, 1 / 400):
        tip, _ = run(step, 5.0)
        speed = np.gradient(tip, step, axis=0, edge_order=2)
        # one coordinate: three uprights of inertia 1/3, two tops of mass 1 with the corner's velocity
        kinetic = 0.5 * 3.0 * np.einsum("ni,ni->n", speed, speed)
        potential = 9.81 * 3.5 * tip[:, 2]
        total = kinetic + potential
        lost.append(abs(total[-3] - total[2]) / kinetic[2])
    assert lost[1] < 0.35 * lost[0] and lost[1] == pytest.approx(0.0, abs=0.05)
