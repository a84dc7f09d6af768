"""Reduced bodies of a character, and the shot that is compiled with them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from calmotion.simulation.compiled_shot import CompiledShot

if TYPE_CHECKING:
    from calmotion.model import ModeTable
    from calmotion.reduction.reduced_body import ReducedBody
    from calmotion.simulation.body_reduction import BodyReduction
    from calmotion.tolerance.pod_subspace import ProjectedShot, ReferenceRun


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


SUBSPACES, TIME_STEP, DIRECTIONS = "subspaces", "time step", "search directions"  # what a run may take over


@dataclass(eq=False)
class RunMemory:
    """What the last run of a shot with the same bodies found, for a run of almost the same motion.

    Attributes:
        projected: The bodies in its directions; None before the first run.
        step: Its time step [s]; 0 where it was not chosen.
        integrator: By which it was simulated.
        search: What its search leaves to the next, see `retargeting.search_memory`.
        searched: The shot of that search, with the bodies of its result.
        taken: Names of what the latest run took over of this.
    """

    projected: ProjectedShot | None = None
    step: float = 0.0
    integrator: str = ""
    search: Any = None
    searched: CompiledShot | None = None
    taken: list[str] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class ConvergedReduction:
    """Reduced bodies that do for a shot.

    Attributes:
        shot: The shot with these bodies.
        error_m: How far a target is from where the last coarser reduction had it [m]. That one would often do, but
            where two reductions agree by chance the finer is the safer.
        known: The shot as animated, simulated with these bodies.
        reduction: Makes these bodies again to another tolerance, on their meshes.
        memory: What runs with these bodies leave for the next one.
    """

    shot: CompiledShot
    error_m: float
    known: ReferenceRun
    reduction: BodyReduction | None = None
    memory: RunMemory = field(default_factory=RunMemory)


def compiled_in(get: Callable[[type[Any]], Any]) -> CompiledShot:
    """The compiled shot of a run, with the finest bodies that the run has.

    Args:
        get: The run's value of a type, None where there is none; it has a `CompiledShot`.
    """
    converged = get(ConvergedReduction)
    compiled: CompiledShot = get(CompiledShot) if converged is None else converged.shot
    return compiled
