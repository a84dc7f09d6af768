"""The verdict on a result: kept or not, and because of what."""

import pytest
from calmotion.model.tolerance import MEASURED, MESH, REDUCTION, SEARCH, STEP, BudgetEntry, verdict_on


def budget(**estimates):
    """An entry for each estimate, in thousandths of the tolerance; each may cost half of it."""
    sources = {"mesh": MESH, "step": STEP, "reduction": REDUCTION, "search": SEARCH}
    return [
        BudgetEntry(sources[name], 0.5, None if value is None else value / 1000.0, "", "")
        for name, value in estimates.items()
    ]


@pytest.mark.parametrize(
    ("estimates", "measured", "kept", "error", "short"),
    [
        ({"step": 300, "mesh": 400}, None, True, 0.7, ""),
        ({"step": 300, "mesh": 900}, None, False, 1.2, MESH),
        ({"step": 900, "mesh": 300}, None, False, 1.2, STEP),
        ({"step": 400, "reduction": 300, "mesh": 400}, None, False, 1.1, STEP),
        ({"step": 900, "mesh": 300}, 0.1, True, 0.1, ""),
        ({"step": 100, "mesh": 300}, 1.5, False, 1.5, MEASURED),
        ({"step": 100, "mesh": 1900}, 0.1, True, 0.1, ""),
        ({"step": 100, "mesh": None}, None, True, 0.1, ""),
        ({"step": 100, "search": 5000}, None, True, 0.1, ""),
        ({}, 0.5, True, 0.5, ""),
        ({}, 1.5, False, 1.5, MEASURED),
    ],
)
def test_errors_add_up_and_a_measured_one_replaces_them(estimates, measured, kept, error, short):
    verdict = verdict_on(budget(**estimates), 1.0, measured)
    assert (verdict.kept, verdict.short) == (kept, short) and verdict.error_m == pytest.approx(error)


def test_what_was_not_estimated_is_not_called_kept():
    verdict = verdict_on([], 1.0)
    assert not verdict.kept and verdict.error_m is None and verdict.short == ""
