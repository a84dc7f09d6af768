"""The comparison of integrators: orders, and the stiff scene of the seed."""

import pytest
from calmotion.multibody import SimulationFailure
from calmotion_plugins.benchmarks.integrators.integrators import (
    WORKING_STEP,
    stiff_scene,
)


def test_only_bdf2_takes_thin_steel_links_through_a_fast_motion():
    """Seed, section 3: RK4 at once with steps thousands of times smaller, Newmark later, BDF2 not at all."""
    scene = stiff_scene()
    run = scene.run(WORKING_STEP, "bdf2")
    assert run.trajectory.refined == () and run.trajectory.max_joint_gap < 1e-6
    with pytest.raises(SimulationFailure) as newmark:
        scene.run(WORKING_STEP, "newmark")
    assert 0.1 < newmark.value.time_s < 2.0
    with pytest.raises(SimulationFailure) as explicit:
        scene.run(WORKING_STEP / 4000, "rk4", 0.1)
    assert explicit.value.time_s < WORKING_STEP
