"""Simplifications in a report: all, or a line."""

import io

from calmotion.cli.reports.limits import print_left_out
from calmotion.cli.tables import console_on


def printed(rows, whole):
    stream = io.StringIO()
    print_left_out(console_on(stream), rows, whole)
    return stream.getvalue().splitlines()


def row(what, error, skipped=False):
    return {"what": what, "why": "because", "estimated_error_m": error, "skipped": skipped}


def test_each_has_its_reason_and_its_error_and_a_skipped_step_says_so():
    rows = [row("modes above 40 Hz", 2e-5), row("no pre-roll", None), row("Draw", None, True)]
    assert printed(rows, True) == [
        "simplified: modes above 40 Hz (because); estimated error 0.02 mm", "simplified: no pre-roll (because)",
        "skipped: Draw (because)",
    ]  # fmt: skip


def test_by_itself_a_report_has_one_line_with_the_largest_error():
    rows = [row("turning", None), row("modes", 2e-5), row("time step 5 ms", 3e-4), row("Draw", None, True)]
    assert printed(rows, False) == [
        "simplified: 3 parts of the model; largest estimated error 0.3 mm (time step 5 ms). --verbose lists all"
    ]
    assert printed([row("turning", None)], False) == ["simplified: 1 part of the model. --verbose lists all"]
    assert printed([row("Draw", None, True)], False) == []
