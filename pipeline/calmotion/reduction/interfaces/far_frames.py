"""Joints that are too far from the surface of their flexible body, before it is meshed."""

from __future__ import annotations

import numpy as np

from calmotion.errors import ShotError, raise_all
from calmotion.geometry.distances import closest_on_triangles
from calmotion.shot import Body, Character
from calmotion.shot.character import Array

LARGEST_GAP = 0.5  # of the size of a body, between its surface and a frame inside its convex hull
OUTSIDE = 0.05  # of the size, by which a frame inside the hull may be outside it
_MESH = 0.02  # of the size: a mesh may be that far from the surface that it was made of


def far_frame(joint: str, body: str, gap: float, center: Array, radius: float) -> ShotError:
    """The error about a joint whose attachment frame is away from the surface by a gap [m]."""
    return ShotError(
        f"the attachment frame of {joint} is {gap:.4g} m away from the surface of this flexible body",
        path=body, attribute="calm:flexible:interfaceRadius",
        found=f"frame at {np.array2string(center, precision=4)} m, radius {radius:.4g} m",
        remedy="Move the frame of the joint onto the body, or author an interfaceRadius larger than this distance",
    )  # fmt: skip


def inside_hull(points: Array, place: Array, margin: float) -> bool:
    """Whether a place is in the convex hull of points, or outside by no more than the margin [m]."""
    from scipy.spatial import ConvexHull

    equations = ConvexHull(points).equations
    return bool((equations[:, :3] @ place + equations[:, 3]).max() <= margin)


def refuse_far_frames(character: Character) -> None:
    """Refuse joints that no mesh of their flexible bodies can touch.

    Raises:
        ShotError: The joints, with their distances.
    """
    problems = []
    for index, body in enumerate(character.bodies):
        if body.flexible is None or body.stiff or body.flexible.mesh_file or body.tets is not None:
            continue
        named = {surface.joint for surface in body.interfaces}
        for joint in character.joints:
            if joint.redundant or joint.path in named or index not in (joint.body0, joint.body1):
                continue
            frame = joint.frame0 if joint.body0 == index else joint.frame1
            problem = _problem(body, joint.path, frame.position)
            if problem is not None:
                problems.append(problem)
    raise_all(problems)


def _problem(body: Body, joint: str, center: Array) -> ShotError | None:
    from scipy.spatial import QhullError

    corners = [surface.points[surface.triangles] for surface in body.surfaces if len(surface.triangles)]
    if not corners or body.flexible is None:
        return None  # the mesher says so
    triangles = np.concatenate(corners)
    points = triangles.reshape(-1, 3)
    if not np.all(np.isfinite(points)):
        return None
    size, radius = float(np.linalg.norm(np.ptp(points, axis=0))), body.flexible.interface_radius
    gap = float(np.linalg.norm(closest_on_triangles(center, triangles) - center, axis=1).min())
    allowed = radius
    if radius < 0.0:
        try:
            inside = inside_hull(points, center, (OUTSIDE + _MESH) * size)
        except QhullError:
            return None  # flat: it encloses no volume
        allowed = LARGEST_GAP * size if inside else 0.0
    return far_frame(joint, body.path, gap, center, max(radius, 0.0)) if gap > allowed + _MESH * size else None
