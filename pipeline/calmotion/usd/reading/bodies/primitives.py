"""UsdGeom's solids: cube, sphere, cylinder, capsule, cone, as closed triangulations and with their exact moments.

Cylinders and capsules also of two radii (`Cylinder_1`, `Capsule_1`)."""

from collections.abc import Callable, Sequence

import numpy as np
from pxr import Usd

from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.mesh.moments import Moments

Part = tuple[float, float, Callable[[Array], Array]]  # from and to along z, and the radius there
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
    if kind == "Sphere":
        radius = _positive(prim, "radius", time)
        profile = _arc(radius, 0.0, -np.pi / 2, np.pi / 2, 2 * _RINGS)
        return (*_revolve(profile), _revolved([_cap(radius, 0.0, -1.0), _cap(radius, 0.0, 1.0)]))
    names = ("radiusBottom", "radiusTop") if kind in _TWO_RADII else ("radius", "radius")
    low, high = (_positive(prim, name, time) for name in names)
    half = _positive(prim, "height", time) / 2.0
    if kind == "Cone":
        high = 0.0
    parts = [(-half, half, lambda z: low + (high - low) * (z + half) / (2.0 * half))]
    if kind.startswith("Capsule"):
        parts += [_cap(low, -half, -1.0), _cap(high, half, 1.0)]
        profile = np.concatenate([_arc(low, -half, -np.pi / 2, 0.0, _RINGS), _arc(high, half, 0.0, np.pi / 2, _RINGS)])
    elif kind == "Cone":
        profile = np.array([[0.0, -half], [low, -half], [0.0, half]])
    else:
        profile = np.array([[0.0, -half], [low, -half], [high, half], [0.0, half]])
    points, triangles = _revolve(profile)
    turn = _axis_permutation(prim, time)
    return points @ turn.T, triangles, _revolved(parts).mapped(turn, np.zeros(3))


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


def _cap(radius: float, equator: float, up: float) -> Part:
    """Half a ball on one side of its equator; up is 1 or -1."""
    low, high = sorted((equator, equator + up * radius))
    return low, high, lambda z: np.sqrt(np.maximum(radius**2 - (z - equator) ** 2, 0.0))


def _revolved(parts: Sequence[Part]) -> Moments:
    """Moments of solids of revolution about z: integrals of r^2, r^2 z, r^2 z^2 and r^4 over z, of degree 4 at most for
    cones and balls, by the rule of Gauss that is exact to degree 5."""
    nodes, weights = np.polynomial.legendre.leggauss(3)
    integrals = np.zeros(4)
    for low, high, radius in parts:
        z = 0.5 * (low + high) + 0.5 * (high - low) * nodes
        area = np.pi * radius(z) ** 2
        rows = np.stack([area, area * z, area * z**2, area**2 / (4.0 * np.pi)])
        integrals += 0.5 * (high - low) * rows @ weights
    volume, first, along, across = integrals
    middle = first / volume
    center = np.array([0.0, 0.0, middle])
    return Moments(float(volume), center, np.diag([across, across, along - volume * middle**2]))
