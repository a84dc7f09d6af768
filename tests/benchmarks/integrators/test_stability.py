"""Stiff and extreme cases run to the end or are refused with a reason, and the command says so."""

import json

import pytest
from calmotion.accuracy import step_error
from calmotion.benchmarks.integrators import outcomes, stability
from calmotion.benchmarks.integrators.outcomes import CASES, FAILED, REFUSED, RUNS, Case, run_case

# what no set of reduced coordinates about a straight arm can follow
TOO_SOFT = [f"1e{power} Pa" for power in (4, 5, 6, 7, 8)] + ["load a million arms", "1:500, plastic"]
TOO_FAST = ["half a turn in a frame, plastic", "100 rad/s, steps of 1/24 s"]


LONG = ["chain, ", "step, 1e-05 s", "jump, half a turn in a frame, plastic"]


def _marked(case):
    name = f"{case.group}, {case.name}"
    return pytest.param(case, id=name, marks=pytest.mark.long if name.startswith(tuple(LONG)) else ())


@pytest.mark.parametrize("case", [_marked(case) for case in CASES])
def test_every_case_runs_or_is_refused_with_a_reason(case):
    outcome = run_case(case)
    assert outcome.outcome == (REFUSED if case.name in TOO_SOFT + TOO_FAST else RUNS), outcome
    if outcome.outcome == REFUSED:
        # where, what, and what to do about it
        assert outcome.why.startswith("/Arm/") and outcome.why.endswith(".") and len(outcome.why) > 100
    else:
        assert outcome.steps > 10 and outcome.error_m < 2.0 and outcome.gap_m < 1e-6


def test_divergence_and_nan_are_failures(monkeypatch):
    (weightless,) = (case for case in CASES if (case.group, case.name) == ("gravity", "none"))
    monkeypatch.setattr(outcomes, "REACH", 0.5)
    assert run_case(Case("a", "b", weightless.scene)).outcome == FAILED
    monkeypatch.setattr(step_error, "CLOSED_GAP", -1.0)
    monkeypatch.setattr(outcomes, "REACH", 5.0)
    assert "came apart" in run_case(Case("a", "b", weightless.scene)).why

    def broken():
        raise ZeroDivisionError("no")

    with pytest.raises(ZeroDivisionError):
        run_case(Case("a", "b", broken))


def test_the_command_prints_one_object_and_fails_with_its_cases(capsys, monkeypatch):
    assert stability.main(["--json", "--only", "load a millionth"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["cases"]
    assert row["outcome"] == RUNS and row["group"] == "mass ratio" and row["steps"] == 961
    monkeypatch.setattr(step_error, "CLOSED_GAP", -1.0)
    assert stability.main(["--only", "load a millionth"]) == 1
    assert "came apart" in capsys.readouterr().out
