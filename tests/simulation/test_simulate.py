"""What a simulation is refused for afterwards."""

import dataclasses

import pytest
from calmotion import ShotError
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot


def gap_of(arm, animation, bodies, **options):
    return simulate_shot(
        compile_shot(arm, animation, bodies), RunSettings(**options), lambda *_: None
    ).before.max_joint_gap


def test_joints_that_drift_apart_are_a_reason_to_refuse(arm, animation, bodies):
    drifted = gap_of(arm, animation, bodies, step=1 / 48, integrator="newmark")
    assert 1e-7 < drifted < 1e-4
    strict = dataclasses.replace(arm, retarget=dataclasses.replace(arm.retarget, tolerance=5.0 * drifted))
    with pytest.raises(ShotError, match="come apart") as caught:
        gap_of(strict, animation, bodies, step=1 / 48, integrator="newmark")
    assert caught.value.remedy and "newmark" in str(caught.value.found)
    assert gap_of(strict, animation, bodies, step=1 / 48) < 1e-7, "BDF2 keeps them closed"
