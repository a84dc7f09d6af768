"""Simplifications in a report: all, or those that cost most."""

import io

import pytest
from calmotion.cli.reports.left_out import LISTED, print_left_out
from calmotion.cli.tables import console_on


def printed(rows, whole):
    stream = io.StringIO()
    print_left_out(console_on(stream), rows, whole)
    return stream.getvalue().splitlines()


def row(what, error, skipped=False):
    return {"what": what, "why": "because", "estimated_error_m": error, "skipped": skipped}


def test_each_has_its_reason_and_its_error_and_a_skipped_step_says_so():
    rows = [row("modes above 40 Hz", 2e-5), row("no pre-roll", None), row("Draw", None, True)]
    assert printed(rows, False) == [
        "simplified: modes above 40 Hz (because); estimated error 0.02 mm", "simplified: no pre-roll (because)",
        "skipped: Draw (because)",
    ]  # fmt: skip


@pytest.mark.parametrize("whole", [True, False])
def test_of_many_those_that_cost_most_are_listed(whole):
    costs = [1e-6 * k for k in range(1, LISTED + 9)]
    rows = [row("turning", None), *(row(f"link {k}", cost) for k, cost in enumerate(costs))]
    lines = printed(rows, whole)
    if whole:
        assert len(lines) == len(rows)
        return
    assert [line.split()[2] for line in lines[:-1]] == [str(k) for k in range(LISTED + 7, 7, -1)]
    assert lines[-1] == "and 9 more, which cost less: --verbose lists all"
