"""The search for the lowest rate that keeps a tolerance."""

from __future__ import annotations

import pytest
from calmotion_plugins.controller_export.lowest_rate import lowest_rate


def test_the_lowest_rate_is_found_with_few_simulations():
    tried = []

    def loss(rate):
        tried.append(rate)
        return 40.0 / rate**2 + 0.05 / rate

    found = lowest_rate(loss, 1e-3, {100: 40.0 / 1e4 + 0.05 / 100}, 1000)
    assert found is not None and loss(found) <= 1e-3 < loss(found - 1)
    assert len(tried) - 2 <= 8


@pytest.mark.parametrize(("known", "expected"), [({}, 8), ({50: 0.0}, 8), ({3: 1.0}, 8), ({8: 0.0}, 8), ({7: 1.0}, 8)])
def test_the_search_may_begin_anywhere(known, expected):
    assert lowest_rate(lambda rate: float(rate < 8), 0.5, dict(known), 1000) == expected


def test_where_no_rate_does_none_is_found():
    assert lowest_rate(lambda rate: 1.0, 0.5, {100: 1.0}, 1000) is None
