"""Integrals of solids against exact values."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.mesh.moments import is_closed, sum_of, surface_moments, tetrahedron_moments
from calmotion.model import MassProperties
from calmotion.usd import schemas
from calmotion.usd.reading.bodies.polygons import triangulate
from calmotion.usd.reading.bodies.primitives import solid
from pxr import Usd, UsdGeom

BOX_TRIANGLES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]], dtype=np.int32,
)  # fmt: skip


def box(size, center) -> np.ndarray:
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return corners * size + center


def test_a_box_far_from_the_origin_has_its_exact_inertia():
    a, b, c = 0.4, 0.2, 0.1
    moments = surface_moments(box([a, b, c], [10.0, -20.0, 30.0]), BOX_TRIANGLES)
    assert moments.volume == pytest.approx(a * b * c, rel=1e-12)
    assert np.allclose(moments.center, [10.0, -20.0, 30.0], atol=1e-12)
    mass = moments.mass_properties(1000.0)
    m = 1000.0 * a * b * c
    assert np.allclose(
        mass.inertia, m / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b]), rtol=1e-9, atol=1e-12
    )


def test_a_surface_that_is_inside_out_is_turned():
    right = surface_moments(box([1, 2, 3], [0, 0, 0]), BOX_TRIANGLES)
    wrong = surface_moments(box([1, 2, 3], [0, 0, 0]), BOX_TRIANGLES[:, ::-1])
    assert wrong.volume == pytest.approx(right.volume) and np.allclose(wrong.second, right.second)


def test_a_single_tetrahedron_has_the_second_moments_of_the_literature():
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]])
    moments = tetrahedron_moments(corners)
    assert moments.volume == pytest.approx(1 / 6)
    # integral of x^2 is 1/60, of x y is 1/120, about the corner
    about_corner = moments.second + moments.volume * np.outer(moments.center, moments.center)
    assert np.allclose(about_corner, np.full((3, 3), 1 / 120) + np.eye(3) / 120)


def test_moments_of_a_mapped_solid_are_the_mapped_moments():
    linear = np.array([[1.0, 0.4, 0], [0, 2.0, -0.3], [0.1, 0, -1.5]])
    points = box([1, 2, 3], [0.2, 0.3, 0.4])
    direct = surface_moments(points @ linear.T + [1, 2, 3], BOX_TRIANGLES)
    mapped = surface_moments(points, BOX_TRIANGLES).mapped(linear, np.array([1.0, 2, 3]))
    assert direct.volume == pytest.approx(mapped.volume)
    assert np.allclose(direct.center, mapped.center) and np.allclose(direct.second, mapped.second)


def test_closed_means_every_edge_twice_and_opposite():
    points = box([1, 1, 1], [0, 0, 0])
    assert is_closed(BOX_TRIANGLES, points)
    assert not is_closed(BOX_TRIANGLES[:-1], points)
    flipped = BOX_TRIANGLES.copy()
    flipped[0] = flipped[0][::-1]
    assert not is_closed(flipped, points)
    split = points[BOX_TRIANGLES].reshape(-1, 3)  # every triangle with points of its own
    assert is_closed(np.arange(len(split), dtype=np.int32).reshape(-1, 3), split)


def test_two_halves_make_the_whole():
    whole = surface_moments(box([2, 1, 1], [0, 0, 0]), BOX_TRIANGLES).mass_properties(5.0)
    halves = [surface_moments(box([1, 1, 1], [x, 0, 0]), BOX_TRIANGLES).mass_properties(5.0) for x in (-0.5, 0.5)]
    found = sum_of(halves)
    assert isinstance(found, MassProperties)
    assert found.mass == pytest.approx(whole.mass) and np.allclose(found.inertia, whole.inertia)


ARROW = np.array([[0.0, 0], [2, -1], [1, 0], [2, 1]])  # dented at its third corner
U = np.array([[0.0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]])
COMB = np.array([[0.0, 0], [9, 0], [9, 2], [8, 2], [8, 1], [5, 1], [5, 2], [4, 2], [4, 1], [1, 1], [1, 2], [0, 2]])


def areas(x, triangles):
    return 0.5 * np.cross(x[triangles[:, 1]] - x[triangles[:, 0]], x[triangles[:, 2]] - x[triangles[:, 0]])


def cut(ring, turn=None):
    points = np.column_stack([ring, np.zeros(len(ring))])
    if turn is not None:
        points = points @ turn.T
    counts, corners = np.array([len(ring)], dtype=np.int32), np.arange(len(ring), dtype=np.int32)
    return points, triangulate(points, counts, corners, np.ones(1, dtype=bool))


def area_of(ring):
    x, y = ring.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


@pytest.mark.parametrize("ring", [ARROW, U, COMB, ARROW[[2, 3, 0, 1]], np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])])
def test_a_polygon_is_covered_once_dented_or_not(ring):
    points, triangles = cut(ring)
    pieces = areas(points, triangles)[:, 2]
    assert len(triangles) == len(ring) - 2
    # every piece faces as the polygon does, so the pieces cannot overlap when their areas add up
    assert (pieces > 0.0).all() and pieces.sum() == pytest.approx(area_of(ring), rel=1e-12)


@pytest.mark.parametrize("ring", [U, U[::-1]])
def test_pieces_face_as_the_polygon_does_wherever_it_lies(ring):
    turn = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    points, triangles = cut(ring, turn)
    pieces = areas(points, triangles) @ turn[:, 2]
    assert pieces == pytest.approx(np.abs(pieces) * np.sign(area_of(ring)))
    assert pieces.sum() == pytest.approx(area_of(ring))


def test_polygons_stay_in_order_and_unwanted_ones_go():
    points = np.vstack([np.column_stack([ring, np.full(len(ring), z)]) for ring, z in ((ARROW, 0.0), (U, 1.0))])
    counts = np.array([4, 2, 8, 3], dtype=np.int32)
    corners = np.array([0, 1, 2, 3, 0, 1, 4, 5, 6, 7, 8, 9, 10, 11, 0, 1, 3], dtype=np.int32)
    triangles = triangulate(points, counts, corners, np.array([True, True, True, False]))
    assert triangles.dtype == np.int32 and len(triangles) == 2 + 6
    assert (triangles[:2] < 4).all() and (triangles[2:] >= 4).all()


def test_a_polygon_that_crosses_itself_still_gives_its_number_of_triangles():
    bow = np.array([[0.0, 0], [1, 1], [1, 0], [0, 1]])
    assert len(cut(bow)[1]) == 2


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
