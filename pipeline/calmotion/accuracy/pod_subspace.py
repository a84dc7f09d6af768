"""Bodies held to the few directions that a shot moves them in.

A reduction keeps whatever a body may do under loads of some kind. A shot does little of it: where 36 coordinates keep
a link's motion to a hundredth of a millimetre, ten of their combinations hold all but 1e-8 of its strain energy from
the first frame to the last. A nonlinear body's forces cost the fourth power of their number.

One simulation with all coordinates tells which combinations, and simulations with them alone, which cost next to
nothing beside it, how many. Linear bodies keep theirs: these are few, and cheap.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.accuracy.integrator_choice import by_fast_scheme
from calmotion.accuracy.step_error import StepRun, distance, simulate_at
from calmotion.errors import ShotError
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.reduction.subspace import principal_subspace, projected_body
from calmotion.shot import Animation, Character, Simplification
from calmotion.shot.character import FlexibleSettings
from calmotion.shot.model_choice import OFF, ON
from calmotion.simulation.prepare import Options

# Square roots of the shares of strain energy that may be missing, each tried after the last; beyond, rounding counts.
MISSING = tuple(10.0 ** (-0.5 * k) for k in range(4, 13))


@dataclass(frozen=True, eq=False)
class ReferenceRun:
    """A simulation with all coordinates: the shot, with its curves, and what came of them."""

    animation: Animation
    run: StepRun


class ProjectedBodies:
    """Bodies in the fewest directions in which all that is known of a shot happens to an allowed error.

    Bodies whose coordinates are the user's choice keep them. Where fewer directions do not do, all are kept; what
    `Options.directions` forces is done whatever the error.

    Args:
        character: The shot's.
        complete: Its bodies with all coordinates, one for each body of the character; None where all are rigid.
        options: Of all simulations.
        allowed: How far a target may be from where a known simulation has it [m].
        known: Simulations of the shot with all coordinates, at least one unless nothing is worth holding.

    Attributes:
        bodies: One for each body of the character, or None.
        error_m: How far a target is from where all coordinates have it, in what was looked at last [m].
    """

    def __init__(
        self, character: Character, complete: Sequence[ReducedBody] | None, options: Options,
        allowed: Callable[[ReferenceRun], float], known: Sequence[ReferenceRun],
    ):  # fmt: skip
        self._character, self._complete, self._options = character, complete, options
        self._allowed, self._known = allowed, list(known)
        self._chosen = _worth(character, complete, options)
        self.bodies, self.error_m = complete, 0.0
        if self._chosen:
            self._hold()

    def _hold(self) -> None:
        assert self._complete is not None
        motion = {b: np.vstack([item.run.elastic[b] for item in self._known]) for b in self._chosen}
        for missing in MISSING:
            few = list(self._complete)
            for b, coordinates in motion.items():
                few[b] = projected_body(few[b], principal_subspace(few[b], coordinates, missing))
            off = [self._off(few, item) for item in self._known]
            forced = self._options.directions == OFF and all(map(np.isfinite, off))
            if forced or all(error <= self._allowed(item) for error, item in zip(off, self._known, strict=True)):
                self.error_m = max(off)
                self.bodies = _told(self._character, self._complete, few, self.error_m)
                return
        self.bodies, self.error_m = self._complete, 0.0

    def _off(self, bodies: Sequence[ReducedBody] | None, known: ReferenceRun) -> float:
        """How far bodies are from a known simulation, by its own step and integrator, at any target and frame [m]."""
        options = replace(self._options, integrator=known.run.integrator or self._options.integrator)
        try:
            run = simulate_at(self._character, known.animation, bodies, options, known.run.step)
        except ShotError:  # with too few coordinates a body may not even find its equilibrium
            return np.inf
        return distance(run.positions, known.run.positions)

    def hold_for(self, animation: Animation, step: float) -> bool:
        """Whether the bodies do for other curves too, by one simulation with all coordinates; if not, they do now.

        Args:
            animation: With its current curves.
            step: Of that simulation [s].

        Raises:
            ShotError: The simulation is not possible.
        """
        if self._complete is None or self.bodies is self._complete:
            return True
        more = reference_run(self._character, animation, self._complete, self._options, step)
        off = self._off(self.bodies, more)
        if off <= self._allowed(more) or self._options.directions == OFF:
            self.error_m = off
            return True
        self._known.append(more)
        self._hold()
        return False


def project_to_subspace(
    character: Character, animation: Animation, bodies: Sequence[ReducedBody] | None, options: Options, step: float,
    allowed: Callable[[ReferenceRun], float], known: ReferenceRun | None = None,
) -> ProjectedBodies:  # fmt: skip
    """Bodies held to what a shot does, by its current curves; other arguments as of `ProjectedBodies`.

    Args:
        step: Of the simulation with all coordinates [s].
        known: It, where it was done.

    Raises:
        ShotError: The shot cannot be simulated.
    """
    if not _worth(character, bodies, options):
        return ProjectedBodies(character, bodies, options, allowed, ())
    if known is None or known.animation.current != animation.current:
        known = reference_run(character, animation, bodies, options, step)
    return ProjectedBodies(character, bodies, options, allowed, [known])


def _worth(character: Character, bodies: Sequence[ReducedBody] | None, options: Options) -> list[int]:
    """Bodies that are nonlinear, and whose coordinates are the program's choice."""
    found: list[int] = []
    if options.directions == ON:
        return found
    for b, body in enumerate(bodies or ()):
        own = character.bodies[b].flexible
        if own is None or body.elasticity is None:
            continue
        if own.mode_count < 0 and own.max_frequency < 0.0 and own.modes_share == FlexibleSettings.modes_share:
            found.append(b)
    return found


def reference_run(
    character: Character, animation: Animation, bodies: Sequence[ReducedBody] | None, options: Options, step: float
) -> ReferenceRun:
    """The shot by its current curves, simulated with all coordinates; arguments as of `simulate_at`."""
    return ReferenceRun(
        animation,
        by_fast_scheme(options, lambda options: simulate_at(character, animation, bodies, options, step)),
    )  # fmt: skip


def _told(
    character: Character, bodies: Sequence[ReducedBody], few: Sequence[ReducedBody], error: float
) -> tuple[ReducedBody, ...]:
    """The bodies in fewer coordinates, each with what it does without; the error is of all of them together."""
    fewer = [b for b in range(len(bodies)) if len(few[b].stiffness) < len(bodies[b].stiffness)]
    told = list(few)
    for b in fewer:
        count, left = len(bodies[b].stiffness), len(few[b].stiffness)
        what = f"{character.bodies[b].path}: POD subspace of {left} of {count} elastic coordinates"
        row = Simplification(what, "the shot does not excite the others", error / len(fewer))
        told[b] = replace(few[b], left_out=(*few[b].left_out, row))
    return tuple(told)
