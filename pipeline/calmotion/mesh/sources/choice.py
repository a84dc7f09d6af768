"""The source of a body's solid: what is the best of all that a shot has of it.

In this order: the visible surfaces, the wrapped visible surfaces, the collision surfaces, the wrapped collision
surfaces. A wrapped surface has all its holes capped and its separate parts joined by struts; where it intersects
itself, all that it winds around is solid. A collision surface is mostly a convex hull: it has another volume and
another section, and so another stiffness. It comes last, or when the shot asks for it.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from calmotion.errors import ShotError
from calmotion.mesh.repair.closed_solid import Solid, closed_solid
from calmotion.model import Body, SurfaceMesh

# least and largest ratio of the volumes of the hulls of collision and visible surfaces: beyond, one has wrong units
_HULLS = (0.02, 50.0)


def solid_of(body: Body, surfaces: tuple[SurfaceMesh, ...]) -> Solid:
    """The solid of a body, with the reasons for its source among its messages.

    Args:
        body: With `flexible` settings.
        surfaces: Visible and hidden (collision) ones, body frame.

    Raises:
        ShotError: No surface encloses a volume; the error is that of the first choice.
    """
    assert body.flexible is not None
    visible = tuple(s for s in surfaces if s.visible and len(s.triangles))
    hidden = tuple(s for s in surfaces if not s.visible and len(s.triangles))
    if body.flexible.geometry == "collision" and hidden:
        visible = ()
    choices = [(visible, "visual surface", False), (visible, "wrapped visual surface", True)]
    if body.flexible.geometry != "visual":
        choices += [(hidden, "collision surface", False), (hidden, "wrapped collision surface", True)]
    first: ShotError | None = None
    for chosen, source, any_hole in choices:
        if not chosen or (chosen is hidden and not _fits(hidden, visible)):
            continue
        try:
            solid = closed_solid(chosen, body.path, any_hole)
        except ShotError as error:
            first = first or error
            continue
        notes = _notes(solid, first, source, visible if chosen is hidden else ())
        return replace(solid, source=source, repairs=(*notes, *solid.repairs))
    if first is None:
        first = ShotError(
            "its surfaces enclose no volume",
            path=body.path,
            found="no triangles",
            remedy="Add a closed Mesh below it, or name a mesh file in calm:flexible:meshFile",
        )
    raise first


def _notes(solid: Solid, reason: ShotError | None, source: str, visible: Sequence[SurfaceMesh]) -> tuple[str, ...]:
    """Why the first choice was none, and how much the volume of a collision surface differs."""
    if reason is None:
        return ()
    note = f"meshed the {source} ({reason.path}: {reason.problem})"
    if visible:
        ratio = solid.volume / max(_hull_volume(visible), np.finfo(float).tiny)
        note += f"; its volume is {ratio:.2g} of that of the hull of the visual surface, and its stiffness differs"
    return (note,)


def _fits(hidden: Sequence[SurfaceMesh], visible: Sequence[SurfaceMesh]) -> bool:
    """Whether collision surfaces have about the size of the visible ones."""
    shown = _hull_volume(visible) if visible else 0.0
    return shown == 0.0 or _HULLS[0] < _hull_volume(hidden) / shown < _HULLS[1]


def _hull_volume(surfaces: Sequence[SurfaceMesh]) -> float:
    try:
        return float(ConvexHull(np.vstack([surface.points[surface.triangles.ravel()] for surface in surfaces])).volume)
    except (QhullError, ValueError):  # flat, or not finite: the repair says so
        return 0.0
