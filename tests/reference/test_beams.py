"""The beam theories against published numbers."""

import numpy as np
import pytest
from beams import pushed_beam, timoshenko_frequencies
from calmotion.model import ElasticMaterial


@pytest.mark.parametrize(
    ("load", "across", "shorter"), [(1.0, 0.30172, 0.05643), (2.0, 0.49346, 0.16064), (10.0, 0.81061, 0.55500)]
)
def test_the_elastica(load, across, shorter):
    """Without stretch and shear: deflections of Mattiasson 1981, of loads P L^2 / EI."""
    x, z, _ = pushed_beam(load, 1.0, 1e12, 1e12, 1.0)
    assert (z, -x) == pytest.approx((across, shorter), abs=1e-5)


def test_a_small_load_bends_and_shears():
    x, z, slope = pushed_beam(1e-4, 2.0, 50.0, 7.0, 3.0)
    assert z == pytest.approx(1e-4 * (8.0 / 9.0 + 2.0 / 7.0), rel=1e-6)
    assert slope == pytest.approx(1e-4 * 4.0 / 6.0, rel=1e-6)
    assert abs(x) < 1e-7


def test_slender_beams_have_the_frequencies_of_the_text_books():
    material = ElasticMaterial("/Looks/Steel", 2.1e11, 0.3, 7850.0)
    found = timoshenko_frequencies(material, 1.0, 1e-3, 3) * 2.0 * np.pi
    scale = np.sqrt(material.youngs_modulus * 1e-6 / 12.0 / material.density)
    assert found / scale == pytest.approx([3.51602, 22.0345, 61.6972], rel=1e-4)
