"""Element size and envelope when nobody says."""

from __future__ import annotations

import pytest
from calmotion.fem.element_size import automatic_element_size, envelope


def test_the_size_follows_the_body():
    beam = automatic_element_size(0.6 * 0.02 * 0.02)
    assert 0.005 < beam < 0.02  # one or two elements across
    assert automatic_element_size(8.0 * 0.6 * 0.02 * 0.02) == pytest.approx(2.0 * beam)


def test_the_envelope_shrinks_with_the_elements_and_with_each_attempt():
    assert envelope(0.01, 0.6, 12, 0) == pytest.approx(1e-4)
    assert envelope(0.01, 0.6, 5000, 0) == pytest.approx(5e-4)
    assert envelope(0.01, 0.6, 5000, 2) == pytest.approx(1.25e-4)
    assert envelope(1.0, 0.1, 5000, 0) == pytest.approx(4e-4)  # never more than a part of the body
