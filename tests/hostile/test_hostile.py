"""Hostile commands end as they should: a sample of cheap ones here, others with `pytest -m long` and `make torture`."""

import faulthandler
import random
import sys
from pathlib import Path

import pytest
from broken_shots import CASES as BROKEN
from calmotion.cli.commands.table import Absent, all_commands

sys.path.insert(0, str(Path(__file__).resolve().parent))

import commands  # noqa: E402
import contradictions  # noqa: E402
import files  # noqa: E402
import hostile  # noqa: E402
import motions  # noqa: E402
import physics  # noqa: E402
import scenes  # noqa: E402
import takes  # noqa: E402

GROUPS = (motions.CASES, commands.CASES, contradictions.CASES, files.CASES, physics.CASES, takes.CASES, scenes.CASES)
CASES = {name: case for cases in GROUPS for name, case in cases.items()}
# Shots that are broken in one way each are refused by `tests/refusals`, in this way as well.
SIMULATED = ("simulate", hostile.SHOT, "-o", "out.usda", "--json", "--step", "20ms")
CASES |= {
    name: hostile.Case(case.make, SIMULATED, hostile.REFUSED if case.place else hostile.DONE, case.place)
    for name, case in BROKEN.items()
}
# Cases of which each takes a fraction of a second: most are refused while the shot is read or the options are.
CHEAP = {name for name, case in CASES.items() if 0 not in case.statuses and case.seconds <= 60.0}
SAMPLE = random.Random(32).sample(sorted(CHEAP - set(BROKEN)), 30)


def can_run(name: str) -> bool:
    """Whether the command is there: those of a plugin are not where its folder was deleted."""
    return not isinstance(all_commands().get(next(iter(CASES[name].command), "")), Absent)


def fault_of(case: hostile.Case, **changed: object) -> list[str]:
    ending = hostile.Ending(**({"status": 1, "out": "", "err": "", "seconds": 0.1} | changed))
    return hostile.faults_of(case, ending, {"shot.usda": "a"}, {"shot.usda": "a"})


def test_each_has_a_name_of_its_own():
    assert sum(map(len, GROUPS)) + len(BROKEN) == len(CASES)


def test_the_judge_sees_what_must_not_be():
    case = hostile.Case(lambda folder: None, ("simulate", "shot.usda", "--json"), told=("here|there",))
    good = '{"error": {"problem": "p", "remedy": "r", "path": "there"}}'
    assert fault_of(case, out=good) == []
    assert "a traceback" in fault_of(case, out=good, err="Traceback (most recent call last)")
    assert "the error has no remedy" in fault_of(case, out=good.replace('"r"', '""'))
    assert any("does not tell" in fault for fault in fault_of(case, out=good.replace("there", "gone")))
    assert hostile.faults_of_time(case, hostile.Ending(1, good, "", 1e3))
    assert not hostile.faults_of_time(case, hostile.Ending(1, good, "", 0.1))
    assert any("exit status" in fault for fault in fault_of(case, out=good, status=0))
    left = hostile.faults_of(case, hostile.Ending(1, good, "", 0.0), {"a": "1"}, {"a": "2", "b": "1"})
    assert left == ["changes ['a']", "leaves ['b']"]
    use = {"quantity": "velocity", "limit": 1.0, "after": 2.0, "exceeded": False}
    report = {"targets": [], "max_error_m": 0.0, "simulation_error_m": 2.0, "tolerance_m": 1.0, "tolerance_kept": True,
              "limits": [use]}  # fmt: skip
    assert len(hostile.faults_of_verdict(report)) == 2
    assert hostile.faults_of_verdict(report | {"tolerance_kept": False, "limits": []}) == []


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in SAMPLE else pytest.mark.long) for name in CASES]
)
def test_a_hostile_command_ends_as_it_should(tmp_path, name):
    if not can_run(name):
        pytest.skip("the plugin of the command is not here")
    # a case that hangs ends its process, which pytest-xdist tells; it goes on with the next one in another
    faulthandler.dump_traceback_later(10.0 * CASES[name].seconds, file=sys.__stderr__, exit=True)
    try:
        ending, faults = hostile.run(CASES[name], tmp_path)
    finally:
        faulthandler.cancel_dump_traceback_later()
    assert not faults, f"{faults}\n{ending.out}\n{ending.err}"
