"""How fine a mesh has to be when nobody says, and how closely it follows the surface."""

from __future__ import annotations

_ELEMENTS = 2000  # of a link: about 4,000 nodes, reduced in a second; bending converges with a cubed element size
_REGULAR = 0.118  # volume of a regular tetrahedron of edge 1
_SIMPLE = 500  # triangles; below, the surface is that of a box or a tube, and following it closely costs nothing


def automatic_element_size(volume: float) -> float:
    """Edge length [m] that fills a volume [m^3] with about 2,000 elements.

    Quadratic elements need one or two across the thickness, which this gives for links up to some thirty times as
    long as they are thick; where a wall is thinner than that, the mesher's elements are as thick as the wall.
    """
    return (volume / (_REGULAR * _ELEMENTS)) ** (1.0 / 3.0)


def envelope(element_size: float, diagonal: float, triangles: int, attempt: int) -> float:
    """How far the mesh may leave the surface [m].

    It, more than the element size, decides how many elements the small features of a surface cost.

    Args:
        element_size: [m].
        diagonal: Of the body's bounding box [m].
        triangles: Of the surface.
        attempt: 0 first; halved for each further one, since the volume was off.
    """
    part = 100.0 if triangles <= _SIMPLE else 20.0
    return min(element_size / part, 4e-3 * diagonal) * 0.5**attempt
