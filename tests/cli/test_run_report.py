import io

import pytest
from calmotion.cli.run_report import REMEDIES, print_accuracy, print_joint_gap
from calmotion.cli.tables import console_on


def report(**values):
    """The entries of a report about its accuracy."""
    budget = [{"source": "mesh", "allowed_m": 4e-4, "estimated_m": None}]
    budget = [{"source": "time step", "allowed_m": 5e-4, "estimated_m": 3e-4}, *budget]
    known = {"error_budget": budget, "tolerance_m": 1e-3, "tolerance_kept": True, "tolerance_missed_by": None}
    return known | {"simulation_error_m": 3e-4, "verified_error_m": None} | values


def printed(values):
    stream = io.StringIO()
    print_accuracy(console_on(stream), values)
    return stream.getvalue()


def test_the_error_budget_is_a_table_and_the_verdict_a_sentence():
    text = printed(report())
    assert "time step   0.5 mm     0.3 mm" in text and "mesh        0.4 mm    unknown" in text
    assert "the simulation keeps the tolerance of 1 mm: error 0.3 mm" in " ".join(text.split())
    measured = printed(report(verified_error_m=2e-4, verified_step_s=5e-4, verified_modes=44))
    said = "measured simulation error 0.2 mm, against a run with steps of 0.5 ms and 44 elastic coordinates"
    assert said in " ".join(measured.split())


@pytest.mark.parametrize("source", REMEDIES)
def test_a_tolerance_that_is_not_kept_is_reported_with_what_would_help(source):
    text = printed(report(tolerance_kept=False, tolerance_missed_by=source, simulation_error_m=2e-3))
    said = f"does not keep the tolerance of 1 mm: error 2 mm, mostly of the {source}. {REMEDIES[source]}"
    assert said in " ".join(text.split())


def test_without_an_estimate_nothing_is_claimed():
    text = printed(report(error_budget=[], tolerance_kept=False, simulation_error_m=None))
    assert text.split() == "the error of the simulation was not estimated; the tolerance is 1 mm".split()


@pytest.mark.parametrize(("gap", "told"), [(0.0, ""), (9e-7, ""), (7.1e-5, "joints come apart by up to 0.071 mm")])
def test_joints_that_come_apart_are_reported(gap, told):
    stream = io.StringIO()
    print_joint_gap(console_on(stream), gap)
    assert stream.getvalue().startswith(told) and bool(stream.getvalue()) == bool(told)
