"""Slits of a wrapped solid that are narrower than its mesh can follow, which nobody made.

Caps that nearly touch a wall, nested shells and parts that almost coincide leave them. Within the distance that
tetrahedra may have to the surface, it is chance whether they close a slit: an ear of a link of the Panda hung on a
thread or was lost, with 56 or 360 Hz, where points were moved by 2 nm.
"""

from typing import Any

import manifold3d
import numpy as np

from calmotion.mesh.grids import CLOSED, closed_slits
from calmotion.mesh.repair.closing import Part, concatenated, connected_pieces
from calmotion.mesh.repair.uniting import NotManifold, manifold_of, part_of, without_detail
from calmotion.mesh.sources.bridges import NARROW
from calmotion.mesh.surfaces.nearby_triangles import unit_normals
from calmotion.mesh.surfaces.slits import Filling, slit_fillings, slit_widths
from calmotion.mesh.tetrahedra import surface_area

_SIDE = 8e-3  # of the size: longest side of triangles, since a triangle faces another side or not as a whole
_SINK = 1e-4  # of the size, by which fillings reach into both sides
# Of the size: detail of which sides are rid before, and how far fillings reach beyond a side. Fillings that do not meet
# leave tunnels: of a leg of Barkour with 74,000 triangles, the surface could be simplified to 12,300 triangles with
# tunnels, to 4,400 with its slits and to 3,000 without both
_DETAIL, _BESIDE = 1e-4, 0.5 * NARROW
_LOST = 5e-3  # largest change of the volume by that: solids that overlap are counted twice before
# Where more of the surface than that has gaps which are wider than those that are filled, it is made anew on a grid of
# this spacing, of the size: link6 of the Panda (15%) and the base of the xArm's gripper (6%); of others 1.2 to 1.8% do.
# Their meshes, which follow dense surfaces the less closely, joined the sides of such gaps in places: 485, 439 and
# 461 Hz on three meshes, and 491 Hz on each since; 251, 239 and 243 Hz, and 332 Hz on each since.
_OFTEN, _SPACING = 0.04, 3.5e-3
_CUT = 0.05  # of the spacing of that grid: detail that is left out
# Most triangles with fillings, of those before, and besides; where there are more, a grid takes their place, too
_MORE, _BESIDES = 2.0, 20_000


def without_slits(whole: Part, scale: float, repairs: list[str]) -> Part:
    """A solid whose slits are filled, those as narrow as gaps between solids that are bridged; and thin cavities.

    Args:
        whole: Outward, in units of the size of the body; may consist of several solids.
        scale: Size of the body [m].
        repairs: A message is appended.

    Returns:
        The same one where it has no slits, or where manifold3d refuses it.
    """
    try:
        solid = manifold_of(whole)
    except NotManifold:
        return whole
    simpler = solid.simplify(_DETAIL)
    solid = simpler if abs(simpler.volume() - whole.volume) < _LOST * whole.volume else solid
    fine = part_of(solid.refine_to_length(_SIDE))
    wider = _too_wide(fine)
    made: Part | None
    if wider > _OFTEN:
        made, told = _on_grid(whole, scale, f"{100.0 * wider:.2g}% of its surface has wider ones than are filled")
    else:
        made, told = _filled(solid, fine, scale)
        if made is not None and len(made.triangles) > _MORE * len(whole.triangles) + _BESIDES:
            made, told = _on_grid(whole, scale, "filling each would make too many triangles")
    if made is not None:
        whole = made
        repairs.append(told)
    pieces = connected_pieces(whole.points, whole.triangles)
    kept = [piece for piece in pieces if not _is_thin_cavity(piece)]
    cavities = len(pieces) - len(kept)
    if cavities and made is None:
        limit = 1e3 * scale * NARROW
        repairs.append(f"filled {cavities} cavit{'ies' if cavities > 1 else 'y'} thinner than {limit:.2g} mm")
    return concatenated(kept) if cavities else whole


def _too_wide(fine: Part) -> float:
    """Share of a surface of small triangles with gaps that are wider than those that are filled, as a grid closes."""
    corners = fine.points[fine.triangles]
    normals, areas = unit_normals(corners)
    widths = slit_widths(corners.mean(axis=1), normals, corners, CLOSED * _SPACING)
    return float(areas[np.isfinite(widths) & (widths > NARROW)].sum() / areas.sum())


def _filled(solid: Any, fine: Part, scale: float) -> tuple[Part | None, str]:
    """A manifold without its slits, and a message; None where it has none.

    Args:
        solid: In units of the size of the body.
        fine: The same with small triangles.
        scale: Size of the body [m].
    """
    fillings = slit_fillings(fine.points, fine.triangles, NARROW, _SINK, _BESIDE, NARROW**2)
    made = [(body, filling.width) for filling in fillings if (body := _body(filling)) is not None]
    if not made:
        return None, ""
    filling = manifold3d.Manifold.batch_boolean([body for body, _ in made], manifold3d.OpType.Add)
    slits, widest = len(filling.decompose()), 1e3 * scale * max(width for _, width in made)
    return part_of(solid + filling), f"filled {slits} slit{'s' if slits > 1 else ''} of up to {widest:.2g} mm"


def _on_grid(whole: Part, scale: float, reason: str) -> tuple[Part, str]:
    """A solid whose slits a grid closes, with few triangles on flat walls; and a message; arguments as of others."""
    made = Part(*closed_slits(whole.points, whole.triangles, _SPACING))
    told = (
        f"closed its slits of up to {1e3 * scale * CLOSED * _SPACING:.2g} mm on a grid, since {reason}: edges are cut "
        f"off by up to {1e3 * scale * _SPACING:.2g} mm"
    )
    return without_detail(made, _CUT * _SPACING), told


def _body(filling: Filling) -> Any:
    """A filling as a manifold; None where it is none, or where it is inside out."""
    try:
        made = manifold_of(Part(filling.points, filling.triangles))
    except NotManifold:
        return None
    return made if made.volume() > 0.0 else None


def _is_thin_cavity(piece: Part) -> bool:
    """Whether a surface bounds a cavity whose mean width is that of a slit."""
    return piece.volume < 0.0 and bool(-2.0 * piece.volume < NARROW * surface_area(piece.points, piece.triangles))
