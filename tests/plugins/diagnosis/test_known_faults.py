"""Known faults of arms that other code simulates are found, and nothing else is."""

from __future__ import annotations

import pytest
from calmotion_plugins.diagnosis import diagnosis_of, situation_of
from faulty_arm import FAULTS, faulty_arm
from faulty_mujoco import recorded_in_mujoco
from faulty_own import recorded_by_us


def found(name, seed, simulator):
    if simulator == "MuJoCo":
        pytest.importorskip("mujoco")
    arm = faulty_arm(seed, {name: 1} if name != "none" else {})
    recording = recorded_in_mujoco(arm) if simulator == "MuJoCo" else recorded_by_us(arm)
    return diagnosis_of(situation_of(arm.shot(), [recording])).causes


@pytest.mark.parametrize(
    "name, seed, simulator", [("friction", 952, "own"), ("base", 906, "MuJoCo"), ("none", 956, "own")]
)
def test_a_fault_is_found(name, seed, simulator):
    first = found(name, seed, simulator)[0]
    assert first.cause == name and first.share > 0.5 and first.remedy


@pytest.mark.long
@pytest.mark.parametrize("name", [*FAULTS, "none"])
def test_each_fault_is_found_and_hardly_anything_else(name):
    causes = found(name, 900 + [*FAULTS, "none"].index(name), "MuJoCo")
    assert causes[0].cause == name and causes[0].share > 0.5
    assert all(cause.share < 0.25 for cause in causes[1:] if cause.cause != "unknown")
