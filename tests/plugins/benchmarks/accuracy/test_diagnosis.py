"""Known faults of arms that other code simulates are found, and nothing else is."""

from __future__ import annotations

import pytest
from calmotion_plugins.benchmarks.accuracy.diagnosis import Answer, answered, confusion, recorded, summary
from calmotion_plugins.benchmarks.scenes.faulty_arm import FAULTS, faulty_arm
from calmotion_plugins.diagnosis import diagnosis_of, situation_of


def found(name, seed, simulator):
    if simulator == "MuJoCo":
        pytest.importorskip("mujoco")
    arm = faulty_arm(seed, {name: 1} if name != "none" else {})
    return diagnosis_of(situation_of(arm.shot(), [recorded(arm, simulator)])).causes


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


def test_the_table_counts_medium_and_strong_faults():
    rows = [
        Answer(1, "own", "links", "medium", "links", "", 0.9, True, 1.0),
        Answer(2, "own", "links", "strong", "base", "links", 0.9, False, 2.0),
        Answer(3, "own", "links", "weak", "unknown", "", 1.0, False, 3.0),
        Answer(4, "own", "delay+friction", "strong", "friction", "delay", 0.9, True, 4.0),
        Answer(5, "own", "none", "-", "none", "", 0.9, True, 0.1),
    ]
    table = {row[0]: row[1:] for row in confusion(rows)}
    assert (
        table["links"][:3] == ["2", "1", "1"]
        and table["two of them"][:2] == ["1", "1"]
        and table["none"][:2] == ["1", "1"]
    )
    assert summary(rows)[0] == (
        "medium and strong: 3 recordings, right first 67%, another cause with confidence 33.3%, "
        "error within the noise 0%"
    )


@pytest.mark.long
def test_an_arm_of_the_table_is_the_same_each_time():
    one, other = answered(1), answered(1)
    assert (one.faults, one.first, one.confidence) == (other.faults, other.first, other.confidence)
