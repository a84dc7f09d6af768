"""The stiff scene of the seed."""

import pytest
from calmotion.multibody import SimulationFailure
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion_plugins.benchmarks.integrators.integrators import Scene

WORKING_STEP = 1.0 / 240.0


def test_only_bdf2_takes_thin_steel_links_through_a_fast_motion():
    """Seed, section 3: RK4 at once with steps thousands of times smaller, Newmark later, BDF2 not at all."""
    # two steel links of 200 x 3 x 3 mm, both lifted by 86 degrees in 0.3 s with 150 g at the end, without damping
    made = beam_arm(
        links=2, length=0.2, thickness=0.003, youngs_modulus=2.1e11, density=7800.0, payload=0.15, damping=0.0,
        elasticity="stvk", modes=8, cells=10,
    )  # fmt: skip
    scene = Scene(made, shot_of(quintic(1.5, 0.3), 2.0, 2))
    run = scene.run(WORKING_STEP, "bdf2")
    assert run.trajectory.refined == () and run.trajectory.max_joint_gap < 1e-6
    with pytest.raises(SimulationFailure) as newmark:
        scene.run(WORKING_STEP, "newmark")
    assert 0.1 < newmark.value.time_s < 2.0
    with pytest.raises(SimulationFailure) as explicit:
        scene.run(WORKING_STEP / 4000, "rk4", 0.1)
    assert explicit.value.time_s < WORKING_STEP
