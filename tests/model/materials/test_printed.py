"""The law of the infill of printed parts."""

import pytest
from calmotion.model.meshes import core_of


def test_the_core_is_as_stiff_as_triangulated_lattices_and_solid_at_the_end():
    assert core_of(0.01, 1e-3).stiffness == pytest.approx(0.01 / 3.0, rel=0.01)
    assert core_of(0.2, 1e-3).stiffness == pytest.approx(0.0769, rel=1e-3)
    assert core_of(1.0, 1e-3).stiffness == pytest.approx(1.0)
    # stiffer than open foams, softer than a share of the material along the load
    assert all(f**2 < core_of(f, 1e-3).stiffness < f for f in (0.1, 0.2, 0.4))
