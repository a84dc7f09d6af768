"""Reduced bodies of a character, and the shot that is compiled with them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from calmotion.simulation.compiled_shot import CompiledShot

if TYPE_CHECKING:
    from calmotion.accuracy.pod_subspace import ReferenceRun
    from calmotion.reduction.reduced_body import ReducedBody
    from calmotion.shot import ModeTable
    from calmotion.simulation.body_reduction import BodyReduction


@dataclass(frozen=True, eq=False)
class ReducedBodies:
    """Bodies as the dynamics takes them, and the frequencies of the flexible ones.

    Attributes:
        bodies: One for each body of the character.
        modes: One for each flexible body.
        reduction: Makes them again to another tolerance; None where that is not possible.
    """

    bodies: tuple[ReducedBody, ...]
    modes: tuple[ModeTable, ...]
    reduction: BodyReduction | None = None


@dataclass(frozen=True, eq=False)
class ConvergedReduction:
    """Reduced bodies that do for a shot.

    Attributes:
        shot: The shot with these bodies.
        error_m: How far a target is from where the last coarser reduction had it [m]. That one would often do, but
            where two reductions agree by chance the finer is the safer.
        known: The shot as animated, simulated with these bodies.
        reduction: Makes these bodies again to another tolerance, on their meshes.
    """

    shot: CompiledShot
    error_m: float
    known: ReferenceRun
    reduction: BodyReduction | None = None


def compiled_in(get: Callable[[type[Any]], Any]) -> CompiledShot:
    """The compiled shot of a run, with the finest bodies that the run has.

    Args:
        get: The run's value of a type, None where there is none; it has a `CompiledShot`.
    """
    converged = get(ConvergedReduction)
    compiled: CompiledShot = get(CompiledShot) if converged is None else converged.shot
    return compiled
