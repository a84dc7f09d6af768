"""UsdGeom's solids: their triangulations are closed, outward, and close to the exact moments."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.usd import schemas
from calmotion.usd.reading.bodies.moments import is_closed, surface_moments
from calmotion.usd.reading.bodies.primitives import solid
from pxr import Usd, UsdGeom

schemas.register()
STAGE = Usd.Stage.CreateInMemory()


def prim_of(kind: str, axis: str = "Z", **values: float) -> Usd.Prim:
    STAGE.RemovePrim("/solid")
    prim = getattr(UsdGeom, kind).Define(STAGE, "/solid").GetPrim()
    if prim.HasAttribute("axis"):
        prim.GetAttribute("axis").Set(axis)
    for name, value in values.items():
        prim.GetAttribute(name).Set(value)
    return prim


CASES = [
    ("Cube", {"size": 0.3}, 0.027),
    ("Sphere", {"radius": 0.5}, 4 / 3 * np.pi * 0.125),
    ("Cylinder", {"radius": 0.5, "height": 2.0}, np.pi * 0.25 * 2),
    ("Capsule", {"radius": 0.5, "height": 2.0}, np.pi * 0.25 * 2 + 4 / 3 * np.pi * 0.125),
    ("Cone", {"radius": 0.5, "height": 2.0}, np.pi * 0.25 * 2 / 3),
    ("Cylinder_1", {"radiusTop": 0.3, "radiusBottom": 0.5, "height": 2.0}, np.pi * 2 * (0.09 + 0.15 + 0.25) / 3),
    (
        "Capsule_1", {"radiusTop": 0.3, "radiusBottom": 0.5, "height": 2.0},
        np.pi * 2 * (0.09 + 0.15 + 0.25) / 3 + 2 / 3 * np.pi * (0.027 + 0.125),
    ),
]  # fmt: skip


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
@pytest.mark.parametrize(("kind", "values", "volume"), CASES)
def test_the_triangulation_agrees_with_the_exact_moments(kind, values, volume, axis):
    points, triangles, exact = solid(prim_of(kind, axis, **values), 0.0)
    assert is_closed(triangles, points)
    assert exact.volume == pytest.approx(volume, rel=1e-12)
    corners = points[triangles]
    signed = np.einsum("na,na->", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) / 6.0
    assert signed > 0.0, "outward by the right-hand rule"
    near = surface_moments(points, triangles)
    assert near.volume == pytest.approx(volume, rel=0.03)
    size = np.ptp(points)
    assert np.allclose(near.center, exact.center, atol=0.005 * size)
    assert np.allclose(near.second, exact.second, atol=0.03 * np.max(exact.second))


@pytest.mark.parametrize("kind", ["Cylinder", "Cone", "Capsule"])
def test_the_axis_is_where_the_solid_is_long(kind):
    for column, axis in enumerate("XYZ"):
        points, _, _ = solid(prim_of(kind, axis, radius=0.1, height=3.0), 0.0)
        assert int(np.argmax(np.ptp(points, axis=0))) == column


@pytest.mark.parametrize("kind", ["Cylinder", "Capsule"])
def test_solids_of_two_equal_radii_are_those_of_one(kind):
    *_, one = solid(prim_of(kind, "Y", radius=0.2, height=0.7), 0.0)
    *_, two = solid(prim_of(f"{kind}_1", "Y", radiusTop=0.2, radiusBottom=0.2, height=0.7), 0.0)
    assert two.volume == pytest.approx(one.volume, rel=1e-12)
    assert np.allclose(two.center, one.center, atol=1e-15) and np.allclose(two.second, one.second, rtol=1e-12)


def test_the_tip_of_a_cone_is_at_the_far_end_of_its_axis():
    points, _, exact = solid(prim_of("Cone", "X", radius=1.0, height=2.0), 0.0)
    assert np.any(np.all(np.isclose(points, [1.0, 0, 0]), axis=1))
    assert np.allclose(exact.center, [-0.5, 0, 0])


def test_a_size_that_is_not_positive_is_refused():
    with pytest.raises(ShotError, match="radius"):
        solid(prim_of("Sphere", radius=0.0), 0.0)
