"""Printed parts: a solid skin around a core of infill."""

from __future__ import annotations

from dataclasses import dataclass

LINE_WIDTH = 0.45e-3  # of a printed line by a nozzle of 0.4 mm, as slicers set it [m]
PERIMETERS = 2  # of a print whose shot does not tell


@dataclass(frozen=True)
class Core:
    """What is inside the skin of a printed part, homogenised.

    Attributes:
        skin: Thickness of the solid skin [m].
        infill: Share of the core that is material; its density over that of the skin.
        stiffness: Its Young's modulus over that of the skin; Poisson's ratio is the same.
    """

    skin: float
    infill: float
    stiffness: float


def core_of(infill: float, skin: float) -> Core:
    """The core of a print.

    Args:
        infill: Share of the core that is material, between 0 and 1, exclusively.
        skin: Thickness of its skin [m].

    Source: the Hashin-Shtrikman bound of isotropic plane lattices, E = E_s f / (3 - 2 f), in Bendsoe and Sigmund 1999,
    Material interpolation schemes in topology optimization; triangulated lattices reach it (f / 3 at low densities:
    Gibson and Ashby 1997, Cellular Solids). Patterns that bend are softer, down to f^2 of open foams.
    """
    return Core(skin, infill, infill / (3.0 - 2.0 * infill))
