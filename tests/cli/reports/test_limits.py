"""Simplifications in a report: all, or a line."""

import io

import pytest
from calmotion.cli.reports.limits import print_left_out, print_limits, print_reason, print_terms
from calmotion.cli.tables import console_on


def row(path, limit, before, after, quantity="effort", cost=None, time=0.5):
    shown = [f"{value:g} N m" for value in (limit, before, after)]
    exceeded = abs(after) > abs(limit)
    values = {"limit": limit, "before": before, "after": after, "shown": shown, "exceeded": exceeded}
    return values | {"path": path, "quantity": quantity, "cost_m": cost, "time_s": time}


def told(limits, before=1.0, after=2.0, interrupted=False, terms=()):
    stream = io.StringIO()
    report = {"limits": limits, "improved": after <= before, "interrupted": interrupted, "terms": terms}
    print_reason(console_on(stream), report)
    return " ".join(stream.getvalue().split())


def test_curves_that_still_exceed_limits_come_with_cause_and_remedy():
    rows = [row("/Shoulder", -25.0, -62.0, -43.0, time=0.085), row("/Wrist", -5.0, 8.0, -6.0, time=5.8)]
    text = told([*rows, row("/Calm", 25.0, 3.0, 4.0)])
    assert text.startswith(
        "The new curves follow it less well and exceed 2 limits: "
        "/Shoulder has effort 43 N m where 25 N m is allowed, and 1 more."
    )
    assert text.endswith(
        "Slow the animation down around 0.09 s, 5.80 s, or raise calm:motor:maxTorque if the motors can do more."
    )
    assert "less well" not in told(rows, after=0.5)


@pytest.mark.parametrize(
    ("rows", "after", "interrupted", "said"),
    [
        ([row("/Arm", 2.0, 3.0, 2.0, cost=1e-3)], 2.0, False, "The new curves keep limits that the animation exceeds;"),
        ([row("/Arm", 2.0, 3.0, 2.0, cost=1e-3)], 0.5, False, ""),
        ([row("/Arm", 2.0, 1.0, 1.0)], 2.0, True, "The search was interrupted before it improved on the animation"),
        ([], float("nan"), False, "The search ended before it improved on the animation"),
        ([], 0.5, False, ""),
    ],
)
def test_worse_curves_come_with_a_reason_and_better_ones_without(rows, after, interrupted, said):
    text = told(rows, after=after, interrupted=interrupted)
    assert text.startswith(said) and bool(text) == bool(said)


def test_terms_of_plugins_are_a_table_and_a_reason_for_worse_curves():
    rough = {"name": "roughness", "unit": "m/s", "label": "", "before": 2.0, "after": 1.0, "limit": None}
    power = {"name": "power", "unit": "W", "label": "/Arm", "before": -20.0, "after": -10.5, "limit": -10.0}
    power |= {"time_s": 0.2, "exceeded": True}
    stream = io.StringIO()
    print_terms(console_on(stream), [rough, power])
    rows = [line.split() for line in stream.getvalue().splitlines()[-2:]]
    assert rows == ["roughness 2 m/s rms 1 m/s rms".split(), "power /Arm -10 W -20 W -10.5 W 0.200 s exceeded".split()]
    assert told([], float("nan"), terms=[rough]) == "", "they are why the curves may be worse"


def test_a_position_keeps_its_sign():
    text = told([row("/Hinge", -1.0, 0.4, -1.5, "position")])
    assert "/Hinge has position -1.5" in text and "limits of the joint" in text


def test_limits_that_cost_nothing_are_not_listed():
    stream = io.StringIO()
    print_limits(console_on(stream), [row("/Arm", 2.0, 1.0, 1.0), row("/Leg", 2.0, 3.0, 2.0, cost=2e-3)], True)
    assert "/Arm" not in stream.getvalue() and "costs 2 mm rms" in stream.getvalue()


def printed(rows, whole):
    stream = io.StringIO()
    print_left_out(console_on(stream), rows, whole)
    return stream.getvalue().splitlines()


def row_left(what, error, skipped=False):
    return {"what": what, "why": "because", "estimated_error_m": error, "skipped": skipped}


def test_each_has_its_reason_and_its_error_and_a_skipped_step_says_so():
    rows = [row_left("modes above 40 Hz", 2e-5), row_left("no pre-roll", None), row_left("Draw", None, True)]
    assert printed(rows, True) == [
        "simplified: modes above 40 Hz (because); estimated error 0.02 mm", "simplified: no pre-roll (because)",
        "skipped: Draw (because)",
    ]  # fmt: skip


def test_by_itself_a_report_has_one_line_with_the_largest_error():
    rows = [
        row_left("turning", None),
        row_left("modes", 2e-5),
        row_left("time step 5 ms", 3e-4),
        row_left("Draw", None, True),
    ]
    assert printed(rows, False) == [
        "simplified: 3 parts of the model; largest estimated error 0.3 mm (time step 5 ms). --verbose lists all"
    ]
    assert printed([row_left("turning", None)], False) == ["simplified: 1 part of the model. --verbose lists all"]
    assert printed([row_left("Draw", None, True)], False) == []
