"""Parts that more than one character has. Metres."""

from __future__ import annotations

from .shapes import Section, Shape, skin

THICK, SLIM = 0.022, 0.011


def printed_link(end: float, slim: float = SLIM) -> Shape:
    """A printed link along x from one joint to another: a chunky block about each, a slender beam between them.

    `slim` is half the thickness of the beam [m].
    """
    beam = [0.052 + (end - 0.097) * k / 9 for k in range(10)]
    stations = [(-0.026, 0.019), (-0.023, THICK), (-0.008, THICK), (0.008, THICK), (0.026, THICK), (0.038, 0.015)]
    stations += [(x, slim) for x in beam]
    stations += [(end - 0.032, 0.015), (end - 0.020, THICK), (end - 0.010, THICK), (end - 0.003, THICK), (end, 0.019)]
    return skin([Section(x, half, half) for x, half in stations], axis="x", sides=12, squareness=5.0)
