"""Tetrahedra -> matrices -> modes -> inertia integrals -> `ReducedBody`.

Names resolve on first use, so that a rigid shot (or `--help`) does not pay for scikit-fem and SciPy.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .reduced_body import Invariants, Marker, ReducedBody, rigid_invariants

if TYPE_CHECKING:
    from .assembly import FEModel, QuadraticMesh, assemble, quadratic_mesh
    from .interfaces import Anchor
    from .natural_modes import frequencies
    from .reduce import reduce_body
    from .tetrahedra import measure_quality, oriented_tets

_LAZY = {
    "Anchor": ".interfaces",
    "FEModel": ".assembly",
    "QuadraticMesh": ".assembly",
    "assemble": ".assembly",
    "frequencies": ".natural_modes",
    "measure_quality": ".tetrahedra",
    "oriented_tets": ".tetrahedra",
    "quadratic_mesh": ".assembly",
    "reduce_body": ".reduce",
}

__all__ = [
    "Anchor",
    "FEModel",
    "Invariants",
    "Marker",
    "QuadraticMesh",
    "ReducedBody",
    "assemble",
    "frequencies",
    "measure_quality",
    "oriented_tets",
    "quadratic_mesh",
    "reduce_body",
    "rigid_invariants",
]


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(import_module(_LAZY[name], __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
