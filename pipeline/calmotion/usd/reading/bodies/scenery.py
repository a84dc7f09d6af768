"""The scenery: still geometry near the robot that belongs to no body. It is drawn, and has no part in the physics."""

from collections.abc import Iterator, Sequence

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Body, SurfaceMesh
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd.reading.bodies import primitives
from calmotion.usd.reading.bodies.shapes import color_of, mesh_geometry
from calmotion.usd.reading.context import Reading, is_rigid_body

NEAR = 1.5  # sizes of the robot: what lies farther from its middle is not read
LARGEST = 5.0  # sizes of the robot: a larger prim is a sky or a landscape
MOST_PRIMS = 20_000  # that are looked at
MOST_TRIANGLES = 200_000  # of all scenery; pictures do not need the rest of a set
SHOWN = ("default", "render")


def scenery_of(reading: Reading, bodies: Sequence[Body]) -> tuple[SurfaceMesh, ...]:
    """Still, visible geometry near the robot, in world axes [m].

    A prim that cannot be read is left out: scenery never makes a shot fail. Animated prims, skinned characters and
    point instances are left out as well.
    """
    cloud = [
        surface.points @ rotation_from_quaternion(body.rest.rotation).T + body.rest.position
        for body in bodies
        for surface in body.surfaces
        if surface.drawn
    ]
    if not cloud:
        return ()
    low, high = np.min([c.min(axis=0) for c in cloud], axis=0), np.max([c.max(axis=0) for c in cloud], axis=0)
    size, middle = float(np.linalg.norm(high - low)), 0.5 * (low + high)
    found: list[SurfaceMesh] = []
    count = 0
    for prim in _still_geometry(reading, middle, size):
        try:
            surface = _surface(reading, prim)
        except (ShotError, Tf.ErrorException):
            continue
        if surface is None or not _is_near(surface.points, middle, size):
            continue
        count += len(surface.triangles)
        if count > MOST_TRIANGLES:
            break
        found.append(surface)
    return tuple(found)


def _is_near(points: Array, middle: Array, size: float) -> bool:
    """Whether the box of points is not too large, and near the middle of the robot."""
    low, high = points.min(axis=0), points.max(axis=0)
    return bool(np.max(high - low) < LARGEST * size and _gap(low, high, middle) < NEAR * size)


def _gap(low: Array, high: Array, middle: Array) -> float:
    """Distance of a point from a box [m]."""
    return float(np.linalg.norm(np.maximum(np.maximum(low - middle, middle - high), 0.0)))


def _still_geometry(reading: Reading, middle: Array, size: float) -> Iterator[Usd.Prim]:
    """Meshes and simple solids near the robot that are visible, not animated, and below no body, skinned character or
    instancer.

    What is far is left out by its box, models as a whole by their extents hints. Of a set of hundreds of thousands of
    prims only the first ones are looked at.
    """
    boxes, scale = UsdGeom.BBoxCache(reading.start, list(SHOWN), useExtentsHint=True), reading.units.length(1.0)
    stage, place = reading.whole or reading.stage, Gf.Vec3d(*(middle / scale))
    walk = iter(stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for count, prim in enumerate(walk):
        if count > MOST_PRIMS:
            reading.note(f"the stage is large: scenery is shown of its first {MOST_PRIMS:,} prims alone")
            return
        if not _box_is_near(boxes, prim, place, size / scale, UsdGeom.Boundable):
            walk.PruneChildren()
            continue
        kind = str(prim.GetTypeName())
        if is_rigid_body(prim) or kind in ("SkelRoot", "PointInstancer") or _is_animated_or_hidden(prim, reading.start):
            walk.PruneChildren()
        elif kind == "Mesh" or kind in primitives.TYPES:
            if str(UsdGeom.Imageable(prim).ComputePurpose()) in SHOWN:
                yield prim


def _box_is_near(
    boxes: UsdGeom.BBoxCache, prim: Usd.Prim, middle: Gf.Vec3d, size: float, boundable: type[UsdGeom.Boundable]
) -> bool:
    """Whether a prim may be near the robot, all in stage units; True where that is not known without its children."""
    if not prim.IsA(boundable) and not prim.HasAttribute("extentsHint"):
        return True
    try:
        box = boxes.ComputeWorldBound(prim).ComputeAlignedRange()
    except RuntimeError:  # of USD; tens of thousands of prims pass here, and an import takes as long as all of this
        return True
    if box.IsEmpty():
        return False
    squared = box.GetDistanceSquared(middle)
    return squared == np.inf or bool(squared < (NEAR * size) ** 2)


def _is_animated_or_hidden(prim: Usd.Prim, time: float) -> bool:
    image = UsdGeom.Imageable(prim)
    if not image:
        return False
    visibility = image.GetVisibilityAttr()
    if visibility.ValueMightBeTimeVarying() or visibility.Get(time) == UsdGeom.Tokens.invisible:
        return True
    xform, points = UsdGeom.Xformable(prim), prim.GetAttribute("points")
    moves = bool(xform) and xform.TransformMightBeTimeVarying()
    return moves or (bool(points) and points.ValueMightBeTimeVarying())


def _surface(reading: Reading, prim: Usd.Prim) -> SurfaceMesh | None:
    """One prim; None where it has no faces."""
    if prim.GetTypeName() == "Mesh":
        points, triangles = mesh_geometry(prim, reading.start)
    else:
        points, triangles, _ = primitives.solid(prim, reading.start)
    if len(triangles) == 0:
        return None
    world = reading.world_matrix(prim)
    placed = reading.units.length(1.0) * (points @ world[:3, :3].T + world[:3, 3])
    if np.linalg.det(world[:3, :3]) < 0.0:
        triangles = triangles[:, ::-1].copy()
    return SurfaceMesh(str(prim.GetPath()), placed, triangles, color_of(prim, reading.start))
