"""Slits of a wrapped solid that are narrower than its mesh can follow, which nobody made.

Caps that nearly touch a wall, nested shells and parts that almost coincide leave them. Within the distance that
tetrahedra may have to the surface, it is chance whether they close a slit: an ear of a link of the Panda hung on a
thread or was lost, with 56 or 360 Hz, where points were moved by 2 nm.
"""

from __future__ import annotations

from typing import Any

from calmotion.geometry.grids.slit_closing import RADIUS, closed_slits
from calmotion.geometry.surfaces.slits import Filling, slit_fillings
from calmotion.geometry.tetrahedra import surface_area

from ..closing import Part, concatenated, connected_pieces
from ..uniting import NotManifold, manifold_of, part_of, without_detail
from .bridges import NARROW

_SIDE = 8e-3  # of the size: longest side of triangles, since a triangle faces another side or not as a whole
_SINK = 1e-4  # of the size, by which fillings reach into both sides
# Of the size: detail of which sides are rid before, and how far fillings reach beyond a side. Fillings that do not meet
# leave tunnels: of a leg of Barkour with 74,000 triangles, the surface could be simplified to 12,300 triangles with
# tunnels, to 4,400 with its slits and to 3,000 without both
_DETAIL, _BESIDE = 1e-4, 0.5 * NARROW
_LOST = 5e-3  # largest change of the volume by that: solids that overlap are counted twice before
_LEASTS = (NARROW**2, 1e-4)  # areas of a part of a side that is filled, of the squared size
# Most triangles with fillings, of those before, and besides: where there are more, the surface is made anew on a grid.
# Of link6 of the Panda fillings made 104,000 triangles of 27,500, which could not be simplified; with slits of up to
# 1.4 mm that stayed it had 485, 439 and 461 Hz on three meshes, and has 490, 490 and 489 Hz since.
_MORE, _BESIDES = 2.0, 20_000
_CUT = 0.05  # of the spacing of that grid: detail that is left out
_SPACING = 2.5e-3  # of the size: gaps of up to 1e-2 are closed, whose sides such meshes may join (`filling.py`)


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
    slits, widest, filled = _filled(solid, int(_MORE * len(whole.triangles)) + _BESIDES)
    if filled is not None:
        whole = filled
        repairs.append(f"filled {slits} slit{'s' if slits > 1 else ''} of up to {1e3 * scale * widest:.2g} mm")
    elif slits:
        whole = _on_grid(whole)
        limit, edge = 1e3 * scale * 2.0 * RADIUS * _SPACING, 1e3 * scale * _SPACING
        repairs.append(
            f"closed {slits} slit{'s' if slits > 1 else ''} and all gaps of up to {limit:.2g} mm on a grid, since "
            f"filling each would make too many triangles: edges are cut off by up to {edge:.2g} mm"
        )
    pieces = connected_pieces(whole.points, whole.triangles)
    kept = [piece for piece in pieces if not _is_thin_cavity(piece)]
    cavities = len(pieces) - len(kept)
    if cavities and filled is None:
        limit = 1e3 * scale * NARROW
        repairs.append(f"filled {cavities} cavit{'ies' if cavities > 1 else 'y'} thinner than {limit:.2g} mm")
    return concatenated(kept) if cavities else whole


def _filled(solid: Any, most: int) -> tuple[int, float, Part | None]:
    """The number of slits of a manifold, the width of the widest, and the solid without them.

    Fillings of its smallest slits are left out where they make more triangles than allowed. Without slits, and where
    the others make more still, there is no other solid.

    Args:
        solid: In units of the size of the body.
        most: Number of triangles.
    """
    import manifold3d

    fine = part_of(solid.refine_to_length(_SIDE))
    slits, widest = 0, 0.0
    for least in _LEASTS:
        fillings = slit_fillings(fine.points, fine.triangles, NARROW, _SINK, _BESIDE, least)
        made = [(body, filling.width) for filling in fillings if (body := _body(filling)) is not None]
        if not made:
            break
        filling = manifold3d.Manifold.batch_boolean([body for body, _ in made], manifold3d.OpType.Add)
        filled = part_of(solid + filling)
        slits, widest = len(filling.decompose()), max(width for _, width in made)
        if len(filled.triangles) <= most:
            return slits, widest, filled
    return slits, widest, None


def _on_grid(whole: Part) -> Part:
    """A solid of which a grid closes the slits; its flat walls have few triangles again."""
    made = Part(*closed_slits(whole.points, whole.triangles, _SPACING))
    return without_detail(made, _CUT * _SPACING)


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
