"""Parts of one flexible body that have materials of their own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a body, such as an insert or a shell, with its own material.

    Attributes:
        path: Prim path of its surface.
        material: Prim path of its material.
        points: Of its surface [m], shape [n, 3], body frame.
        triangles: Shape [m, 3], outward; nearly closed is enough.
        modulus: Its Young's modulus over that of the material of the body.
        density: Its density over that of the material of the body.
        damping: Its fraction of critical damping.
    """

    path: str
    material: str
    points: np.ndarray
    triangles: np.ndarray
    modulus: float
    density: float
    damping: float
