"""UsdGeom's solids: cube, sphere, cylinder, capsule, cone, as closed triangulations and with their exact moments.

Cylinders and capsules also of two radii (`Cylinder_1`, `Capsule_1`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.usd.reading.bodies.moments import Moments, together

if TYPE_CHECKING:
    from pxr import Usd

_TWO_RADII = ("Cylinder_1", "Capsule_1")
TYPES = ("Cube", "Sphere", "Cylinder", "Capsule", "Cone", *_TWO_RADII)
_SIDES = 32  # facets around an axis: within 0.5 % of a circle
_RINGS = 8  # rings of a hemisphere

_CUBE = np.array(
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]],
)


def solid(prim: Usd.Prim, time: float) -> tuple[Array, IntArray, Moments]:
    """Triangulate one of UsdGeom's solids, in its own axes and stage units.

    Args:
        prim: A Usd.Prim of one of `TYPES`.
        time: Time code.

    Returns:
        Points [n, 3], outward triangles [m, 3], exact moments.

    Raises:
        ShotError: A size that is not positive.
    """
    kind = str(prim.GetTypeName())
    if kind == "Cube":
        size = _positive(prim, "size", time)
        return (*_cube(size), Moments(size**3, np.zeros(3), np.eye(3) * size**5 / 12.0))
    if kind in _TWO_RADII:
        return _of_two_radii(prim, kind, time)
    radius = _positive(prim, "radius", time)
    if kind == "Sphere":
        profile = _arc(radius, 0.0, -np.pi / 2, np.pi / 2, 2 * _RINGS)
        moments = Moments(4.0 / 3.0 * np.pi * radius**3, np.zeros(3), np.eye(3) * 4.0 / 15.0 * np.pi * radius**5)
        return (*_revolve(profile), moments)
    height = _positive(prim, "height", time)
    half = height / 2.0
    if kind == "Cylinder":
        profile = np.array([[0.0, -half], [radius, -half], [radius, half], [0.0, half]])
        moments = _cylinder(radius, height)
    elif kind == "Cone":
        profile = np.array([[0.0, -half], [radius, -half], [0.0, half]])
        volume = np.pi * radius**2 * height / 3.0
        moments = Moments(
            volume,
            np.array([0.0, 0.0, -height / 4.0]),
            volume * np.diag([3.0 / 20.0 * radius**2] * 2 + [3.0 / 80.0 * height**2]),
        )
    else:
        profile = np.concatenate(
            [_arc(radius, -half, -np.pi / 2, 0.0, _RINGS), _arc(radius, half, 0.0, np.pi / 2, _RINGS)]
        )
        moments = _capsule(radius, height)
    points, triangles = _revolve(profile)
    turn = _axis_permutation(prim, time)
    return points @ turn.T, triangles, moments.mapped(turn, np.zeros(3))


def _of_two_radii(prim: Usd.Prim, kind: str, time: float) -> tuple[Array, IntArray, Moments]:
    """A frustum, and with hemispheres of its radii for a capsule."""
    low, high, height = (_positive(prim, name, time) for name in ("radiusBottom", "radiusTop", "height"))
    half = height / 2.0
    parts = [_frustum(low, high, height)]
    profile = np.array([[0.0, -half], [low, -half], [high, half], [0.0, half]])
    if kind == "Capsule_1":
        parts += [_hemisphere(low, -half, -1.0), _hemisphere(high, half, 1.0)]
        profile = np.concatenate([_arc(low, -half, -np.pi / 2, 0.0, _RINGS), _arc(high, half, 0.0, np.pi / 2, _RINGS)])
    points, triangles = _revolve(profile)
    turn = _axis_permutation(prim, time)
    return points @ turn.T, triangles, together(parts).mapped(turn, np.zeros(3))


def _positive(prim: Usd.Prim, name: str, time: float) -> float:
    value = prim.GetAttribute(name).Get(time)
    if value is None or not (np.isfinite(value) and value > 0.0):
        raise ShotError(
            "must be positive", path=prim.GetPath(), attribute=name, found=value, remedy="Author a positive size"
        )
    return float(value)


def _axis_permutation(prim: Usd.Prim, time: float) -> Array:
    """The rotation, shape [3, 3], that takes z to the prim's axis (a permutation, so it is exact)."""
    axis = str(prim.GetAttribute("axis").Get(time) or "Z")
    order = {"X": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "Y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]]}.get(axis)
    return np.eye(3) if order is None else np.array(order, dtype=np.float64)


def _cube(size: float) -> tuple[Array, IntArray]:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * (size / 2.0)
    quads = _CUBE
    # Corner index is 4x + 2y + z; each quad is listed so that its first three corners turn outward.
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    normals = np.cross(
        corners[triangles[:, 1]] - corners[triangles[:, 0]], corners[triangles[:, 2]] - corners[triangles[:, 0]]
    )
    inward = np.einsum("na,na->n", normals, corners[triangles].mean(axis=1)) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return corners, triangles.astype(np.int32)


def _arc(radius: float, center: float, start: float, end: float, count: int) -> Array:
    angles = np.linspace(start, end, count + 1)
    profile = np.stack([radius * np.cos(angles), center + radius * np.sin(angles)], axis=1)
    profile[np.isclose(np.abs(angles), np.pi / 2), 0] = 0.0
    return profile


def _revolve(profile: Array) -> tuple[Array, IntArray]:
    """A closed surface from a profile (radius, z) [k, 2] that goes up from axis to axis."""
    angles = np.arange(_SIDES) * (2.0 * np.pi / _SIDES)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    points = [np.array([[0.0, 0.0, profile[0, 1]]])]
    for radius, z in profile[1:-1]:
        points.append(np.concatenate([radius * ring, np.full((_SIDES, 1), z)], axis=1))
    points.append(np.array([[0.0, 0.0, profile[-1, 1]]]))
    here = np.arange(_SIDES)
    there = (here + 1) % _SIDES
    rings = len(profile) - 2
    top = 1 + rings * _SIDES
    faces = [np.stack([np.zeros_like(here), 1 + there, 1 + here], axis=1)]
    for k in range(rings - 1):
        low, high = 1 + k * _SIDES, 1 + (k + 1) * _SIDES
        faces.append(np.stack([low + here, low + there, high + there], axis=1))
        faces.append(np.stack([low + here, high + there, high + here], axis=1))
    last = 1 + (rings - 1) * _SIDES
    faces.append(np.stack([last + here, last + there, np.full_like(here, top)], axis=1))
    return np.concatenate(points), np.concatenate(faces).astype(np.int32)


def _cylinder(radius: float, height: float) -> Moments:
    volume = np.pi * radius**2 * height
    return Moments(volume, np.zeros(3), volume * np.diag([radius**2 / 4.0] * 2 + [height**2 / 12.0]))


def _capsule(radius: float, height: float) -> Moments:
    """A cylinder and two hemispheres (centroid 3r/8 off the equator, second moment about the equator 2/15 pi r^5)."""
    cylinder = _cylinder(radius, height)
    ball = 4.0 / 3.0 * np.pi * radius**3
    across = cylinder.second[0, 0] + 4.0 / 15.0 * np.pi * radius**5
    offset = height / 2.0
    along = cylinder.second[2, 2] + 4.0 / 15.0 * np.pi * radius**5 + ball * (offset**2 + 0.75 * offset * radius)
    return Moments(cylinder.volume + ball, np.zeros(3), np.diag([across, across, along]))


def _frustum(low: float, high: float, height: float) -> Moments:
    """A cone that is cut off, from radius `low` at -height/2 to `high` at height/2: integrals of r^2 and r^4 over z."""
    d = high - low
    area = low**2 + low * d + d**2 / 3.0
    first = low**2 / 2.0 + 2.0 * low * d / 3.0 + d**2 / 4.0  # times z / height, from the lower end
    second = low**2 / 3.0 + low * d / 2.0 + d**2 / 5.0
    fourth = sum(low**k * high ** (4 - k) for k in range(5)) / 5.0
    center = first / area
    across = np.pi * height * fourth / 4.0
    along = np.pi * height**3 * (second - first * center)
    return Moments(
        np.pi * height * area, np.array([0.0, 0.0, height * (center - 0.5)]), np.diag([across, across, along])
    )


def _hemisphere(radius: float, equator: float, up: float) -> Moments:
    """Half a ball on one side of its equator; up is 1 or -1 (centroid 3r/8 off the equator)."""
    volume, own = 2.0 / 3.0 * np.pi * radius**3, 2.0 / 15.0 * np.pi * radius**5
    off = 0.375 * radius
    return Moments(volume, np.array([0.0, 0.0, equator + up * off]), np.diag([own, own, own - volume * off**2]))
