"""Meshes cut along the rims of their interface patches, so that patches do not depend on the elements."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.errors import ShotError
from calmotion.mesh.bisection import bisected
from calmotion.mesh.patches.automatic_patch import Skin
from calmotion.mesh.patches.interface_patches import AttachmentFrame, InterfacePatch, interface_patches
from calmotion.mesh.patches.sphere_cut import cut, inside, just_reached
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.mesh.surfaces.distances import triangle_parts
from calmotion.mesh.tetrahedra import boundary_triangles, corner_keys, surface_area
from calmotion.model.character import Body

_PARTS = triangle_parts(12)
_EDGE = 0.5  # of the radius of a disc of the area of a patch: longest edge at its rim, which has twelve sides or more
_BISECTIONS = 12
# Spheres of a patch that are tried, and relative error of its area that is enough; how often elements along which a
# sphere passes are bisected, and error from which they are
_TRIALS, _AREA, _ROUNDS, _FAR = 5, 5e-3, 4, 0.02


@dataclass(frozen=True, eq=False)
class _Rim:
    """A sphere along which a mesh was cut.

    Attributes:
        patch: Of which it is.
        origin: Of the frame of the joint [m], shape [3].
        center, radius: [m].
        axis: Of the joint; None: the radius is given.
    """

    patch: InterfacePatch
    origin: Array
    center: Array
    radius: float
    axis: Array | None


def with_rims(
    points: Array, tets: IntArray, body: Body, attachments: Sequence[AttachmentFrame], meshed: Skin | None = None
) -> tuple[Array, IntArray, tuple[tuple[Array, IntArray], ...]]:
    """A mesh cut along the rims of the patches that are spheres about joints.

    A rim is a polygon; its sphere is somewhat larger than that of the patch, so that the areas are the same. Where two
    patches would meet, each is cut along the ball that it keeps to.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4], positive volumes.
        body: With `flexible` settings.
        attachments: Frames of its joints and targets.
        meshed: The surface that was meshed; None: that of the mesh.

    Returns:
        Points and tetrahedra, and for each such patch the origin of its frame and its triangles, shape [k, 3].
    """
    assert body.flexible is not None
    if not any(attachment.kind == "interface" for attachment in attachments):
        return points, tets, ()
    try:
        radius = body.flexible.interface_radius
        whole = interface_patches(quadratic_mesh(points, tets), attachments, radius, body.path, meshed=meshed)
    except ShotError:
        return points, tets, ()  # the reduction reports it
    rims: list[_Rim] = []
    given = radius >= 0.0
    for patch in whole:
        frame = attachments[patch.attachments[0]].frame
        for center in patch.centers:
            axis = None if given else frame.axis
            points, tets = _finer_at(points, tets, center, patch.radius, axis)
            done = [(rim.center, rim.radius) for rim in rims]
            points, tets, radius = _cut_to_area(points, tets, center, patch.radius, done, axis)
            for ball in patch.balls:
                kept = _held(points, boundary_triangles(tets), [*done, (center, radius)])
                points, tets = cut(points, tets, *ball, kept)
            rims.append(_Rim(patch, frame.position, center, radius, axis))
    found: dict[int, tuple[Array, list[IntArray]]] = {}
    for rim in rims:
        held = _within(points, tets, rim.center, rim.radius, rim.axis)
        for ball in rim.patch.balls:
            held = held[inside(points[held], *ball)]
        found.setdefault(id(rim.patch), (rim.origin, []))[1].append(held)
    made = ((origin, np.concatenate(parts)) for origin, parts in found.values())
    return points, tets, tuple((origin, triangles) for origin, triangles in made if len(triangles))


def _held(points: Array, surface: IntArray, done: Sequence[tuple[Array, float]]) -> BoolArray:
    """Which points are those of patches along whose spheres the mesh was cut: what is cut later must not move them."""
    held = np.zeros(len(points), dtype=bool)
    for center, radius in done:
        held[surface[inside(points[surface], center, radius)]] = True
    return held


def _cut_to_area(
    points: Array, tets: IntArray, center: Array, radius: float, done: Sequence[tuple[Array, float]] = (),
    axis: Array | None = None,
) -> tuple[Array, IntArray, float]:  # fmt: skip
    """The mesh, cut along a sphere so that the polygon of its rim has the area within a radius, and its radius [m].

    Elements along which the sphere passes, as along the side of a cylinder, are inside or outside: where they are too
    large for the area, they are bisected.

    Args:
        done: Spheres of patches along which it was cut before.
        axis: Of the joint; None: the radius is given, and all of the surface within it counts.
    """
    for k in range(_ROUNDS):
        cut_mesh, missing = _nearest_area(points, tets, center, radius, done, axis)
        if missing <= _FAR or k == _ROUNDS - 1:
            break
        triangles = boundary_triangles(tets)
        share = _share_within(points, triangles, center, radius)
        points, tets, _ = bisected(points, tets, _behind(tets, triangles[(share > 0.0) & (share < 1.0)]))
    return cut_mesh


def _nearest_area(
    points: Array, tets: IntArray, center: Array, radius: float, done: Sequence[tuple[Array, float]],
    axis: Array | None,
) -> tuple[tuple[Array, IntArray, float], float]:  # fmt: skip
    """`_cut_to_area` with these elements, by the best of some spheres, and the relative error of the area.

    Corners that move onto a sphere change the area by steps, so that the best may not be the last.
    """
    surface = boundary_triangles(tets)
    held = _held(points, surface, done)
    surface = _held_about(points, surface, center, radius, axis)
    area, smaller, larger = (_area_within(points, surface, center, part * radius) for part in (1.0, 0.9, 1.1))
    slope = max((larger - smaller) / (0.2 * radius), np.finfo(float).tiny)
    best, least, trial = (points, tets, radius), np.inf, radius
    low = high = None  # the last spheres with too small and with too large an area
    for _ in range(_TRIALS):
        made, split = cut(points, tets, center, trial, held)
        missing = area - surface_area(made, _within(made, split, center, trial, axis))
        if abs(missing) < least:
            best, least = (made, split, trial), abs(missing)
        if least <= _AREA * area:
            break
        low, high = ((trial, missing), high) if missing > 0.0 else (low, (trial, missing))
        if low is None or high is None:
            trial = float(np.clip(trial + missing / slope, 0.9 * radius, 1.1 * radius))
        else:
            trial = low[0] + (high[0] - low[0]) * low[1] / (low[1] - high[1])
    return best, least / max(area, np.finfo(float).tiny)


def _held_about(points: Array, surface: IntArray, center: Array, radius: float, axis: Array | None) -> IntArray:
    """A surface without what a sphere just reaches and the joint in its center does not hold."""
    return surface if axis is None else surface[~just_reached(points, surface, center, radius, axis)]


def _within(points: Array, tets: IntArray, center: Array, radius: float, axis: Array | None = None) -> IntArray:
    """Triangles of the surface of a mesh that was cut that a joint holds within the sphere, shape [k, 3]."""
    triangles = boundary_triangles(tets)
    held = triangles[inside(points[triangles], center, radius)]
    if axis is not None:
        held = held[~just_reached(points, held, center, radius, axis, beyond=np.inf)]
    return np.ascontiguousarray(held)


def _share_within(points: Array, triangles: IntArray, center: Array, radius: float) -> Array:
    """Share of each triangle within a sphere, shape [k]."""
    corners, share = points[triangles] - center, np.zeros(len(triangles))
    middle = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    near = np.flatnonzero(np.linalg.norm(middle, axis=1) <= radius + reach)
    at = np.einsum("pk,tkx->tpx", _PARTS, corners[near])
    share[near] = np.mean(np.linalg.norm(at, axis=-1) <= radius, axis=1)
    return share


def _area_within(points: Array, triangles: IntArray, center: Array, radius: float) -> float:
    """Area of a surface within a sphere [m^2]."""
    x = points[triangles]
    area = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    return float(area @ _share_within(points, triangles, center, radius))


def _finer_at(
    points: Array, tets: IntArray, center: Array, radius: float, axis: Array | None
) -> tuple[Array, IntArray]:
    """The mesh, bisected where edges of the surface at the sphere are long beside what it holds.

    A sphere about a joint far from the surface is much larger than the disc that it cuts: of a flange of the Panda it
    held six triangles, whose frequency differed by 4% on three meshes.
    """
    area = _area_within(points, _held_about(points, boundary_triangles(tets), center, radius, axis), center, radius)
    longest = _EDGE * min(radius, float(np.sqrt(area / np.pi)) or radius)
    for _ in range(_BISECTIONS):
        triangles = boundary_triangles(tets)
        x = points[triangles]
        edge = np.linalg.norm(x - x[:, [1, 2, 0]], axis=2).max(axis=1)
        share = _share_within(points, triangles, center, radius)
        long = (share > 0.0) & (share < 1.0) & (edge > longest)
        if not long.any():
            break
        points, tets, _ = bisected(points, tets, _behind(tets, triangles[long]))
    return points, tets


def _behind(tets: IntArray, triangles: IntArray) -> IntArray:
    """The tetrahedra of which some triangles are faces."""
    keys, wanted = corner_keys(tets[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]]), corner_keys(triangles)
    return np.flatnonzero(np.isin(keys, wanted).any(axis=1)).astype(np.int32)
