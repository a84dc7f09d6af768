"""Bodies restricted to the few directions in which a shot deforms them (proper orthogonal decomposition).

A reduction keeps whatever a body may do under loads of some kind. A shot does little of it: where 36 coordinates keep
a link's motion to a hundredth of a millimetre, ten of their combinations hold all but 1e-8 of its strain energy from
the first frame to the last. A nonlinear body's forces cost the fourth power of their number.

One simulation with all coordinates tells which combinations, and simulations with them alone, which cost next to
nothing beside it, how many. Linear bodies keep theirs: these are few, and cheap.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from calmotion.errors import ShotError
from calmotion.model import Animation, Character, Simplification, Track
from calmotion.model.character import FlexibleSettings
from calmotion.model.model_choice import OFF, ON
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import SUBSPACE
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.reduction.subspace import principal_subspace, projected_body
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.tolerance.integrator_choice import by_fast_scheme
from calmotion.tolerance.step_error import StepRun, distance, simulate_at

# Square roots of the shares of strain energy that may be missing, each tried after the last; beyond, rounding counts.
MISSING = tuple(10.0 ** (-0.5 * k) for k in range(4, 13))
FINER = 0.1  # of the missing share: directions of a subspace that tells the error of one


@dataclass(frozen=True, eq=False)
class ReferenceRun:
    """A simulation with all coordinates: the shot with its curves, and its result."""

    animation: Animation
    run: StepRun


class ProjectedShot:
    """A shot with its bodies restricted to the fewest directions that give its known motions with an allowed error.

    Bodies whose coordinates are the user's choice keep them. Where fewer directions are not accurate, all are kept,
    unless `RunSettings.directions` forces them.

    Args:
        complete: The shot, its bodies with all coordinates.
        options: Of all simulations.
        allowed: Largest distance of a target from its position in a known simulation [m].
        known: Simulations of the shot with all coordinates, at least one unless no body can be projected.

    Attributes:
        shot: The shot with the projected bodies.
        error_m: Largest distance of a target from its position with all coordinates, in the last comparison [m].
    """

    def __init__(
        self, complete: CompiledShot, options: RunSettings, allowed: Callable[[ReferenceRun], float],
        known: Sequence[ReferenceRun],
    ):  # fmt: skip
        self._complete, self._options = complete, options
        self._allowed, self._known = allowed, list(known)
        self._chosen = _candidates(complete, options)
        self.shot, self.error_m, self._missing = complete, 0.0, MISSING[0]
        if self._chosen:
            self._project()

    def of_shot(self, shot: CompiledShot, allowed: Callable[[ReferenceRun], float]) -> ProjectedShot:
        """The same bodies in another shot of the robot, whose motion is almost that of the known simulations.

        Args:
            shot: Its bodies with all coordinates, the same as those of this one.
            allowed: As of the class.
        """
        other = copy(self)
        other._complete, other._known, other._allowed = shot, list(self._known), allowed
        other.shot = shot if self.shot is self._complete else shot.with_bodies(self.shot.bodies)
        return other

    def finer_run(self, step: float, options: RunSettings, tracks: Sequence[Track] | None = None) -> StepRun | None:
        """The shot in the directions for a hundredth of the missing energy; None where it has all coordinates.

        It costs a fraction of a simulation with all coordinates, and its distance from the one in the directions tells
        whether a motion that is almost a known one leaves them.

        Args:
            step: [s].
            options: Of the run.
            tracks: The motors' curves; None: the shot's current ones.

        Raises:
            ShotError: The simulation is not possible.
        """
        if self.shot is self._complete:
            return None
        complete = self._complete if tracks is None else self._complete.with_tracks(tracks)
        return simulate_at(complete.with_bodies(self._few(FINER * self._missing)), options, step)

    def _few(self, missing: float) -> list[ReducedBody]:
        """The bodies in the directions of the known simulations, but for a share of their energy."""
        few = list(self._complete.bodies)
        for b in self._chosen:
            motion = np.vstack([item.run.elastic[b] for item in self._known]).astype(float)
            few[b] = projected_body(few[b], principal_subspace(few[b], motion, missing))
        return few

    def _project(self) -> None:
        # what did not do for fewer known simulations does not do for more
        levels = [missing for missing in MISSING if missing <= self._missing]
        # bodies in too few directions hardly move, and to divide their steps would take longer than all else
        failed = self._tried(levels, divides=False)
        if failed:
            failed = self._tried(failed, divides=True)
        if failed is not None:
            self.shot, self.error_m = self._complete, 0.0

    def _tried(self, levels: Sequence[float], divides: bool) -> list[float] | None:
        """Project the shot to the first subspace that is accurate; else those that cannot be simulated.

        Args:
            levels: Shares of energy that may be missing, as of `MISSING`.
            divides: As of `simulate_at`.
        """
        complete, counts, failed = self._complete, list[int](), list[float]()
        for missing in levels:
            few, last = self._few(missing), counts
            counts = [len(body.stiffness) for body in few]
            if counts == last:
                continue
            accurate, error = self._largest_off(complete.with_bodies(few), divides)
            if accurate:
                self.shot, self._missing = complete.with_bodies(few), missing
                self.tell(error)
                return None
            failed += [] if np.isfinite(error) else [missing]
        return failed

    def _largest_off(self, shot: CompiledShot, divides: bool) -> tuple[bool, float]:
        """Whether it is allowed, and the largest distance of a target from any known simulation, up to one too many."""
        largest = 0.0
        for item in self._known:
            if item.animation.tempo is not self._complete.animation.tempo:
                continue  # what is known at another tempo gives directions, but is another motion
            off = self._off(shot, item, divides)
            largest = max(largest, off)
            if not np.isfinite(off) or (off > self._allowed(item) and self._options.directions != OFF):
                return False, largest
        return True, largest

    def _off(self, shot: CompiledShot, known: ReferenceRun, divides: bool = True) -> float:
        """Largest distance of a target from a known simulation, with the same step and integrator [m]."""
        options = replace(self._options, integrator=known.run.integrator or self._options.integrator)
        try:
            run = simulate_at(shot.with_tracks(known.animation.current), options, known.run.step, divides=divides)
        except ShotError:  # with too few coordinates a body may not even find its equilibrium
            return np.inf
        return distance(run.positions, known.run.positions)

    def complete_run(self, tracks: Sequence[Track], step: float) -> ReferenceRun | None:
        """Other curves, simulated with all coordinates; None where the shot has all of them.

        Args:
            tracks: The motors' current curves.
            step: [s].

        Raises:
            ShotError: The simulation is not possible.
        """
        if self.shot is self._complete:
            return None
        return reference_run(self._complete.with_tracks(tracks), self._options, step)

    def is_accurate_for(self, more: ReferenceRun | None) -> bool:
        """Whether the bodies are accurate for other curves, from `complete_run`; if not, they are projected anew."""
        if more is None:
            return True
        off = self._off(self.shot, more)
        self._known.append(more)
        if off <= self._allowed(more) or self._options.directions == OFF:
            self.tell(off)
            return True
        self._project()
        return False

    def tell(self, error: float) -> None:
        """The bodies' directions are off by this much in the motion that counts from now on [m]."""
        complete = self._complete
        self.error_m = error
        if self.shot is not complete:
            self.shot = complete.with_bodies(_told(complete.character, complete.bodies, self.shot.bodies, error))


def project_to_subspace(
    shot: CompiledShot, options: RunSettings, step: float, allowed: Callable[[ReferenceRun], float],
    known: ReferenceRun | None = None,
) -> ProjectedShot:  # fmt: skip
    """A shot with its bodies projected for its current curves; other arguments as of `ProjectedShot`.

    Args:
        step: Of the simulation with all coordinates [s].
        known: That simulation, if it exists already.

    Raises:
        ShotError: The shot cannot be simulated.
    """
    if not _candidates(shot, options):
        return ProjectedShot(shot, options, allowed, ())
    if known is None or known.animation.current != shot.animation.current:
        known = reference_run(shot, options, step)
    return ProjectedShot(shot, options, allowed, [known])


def _candidates(shot: CompiledShot, options: RunSettings) -> list[int]:
    """Bodies that are nonlinear, and whose coordinates are the program's choice."""
    found: list[int] = []
    if options.directions == ON:
        return found
    for b, body in enumerate(shot.bodies):
        own = shot.character.bodies[b].flexible
        if own is None or body.elasticity is None:
            continue
        if own.mode_count < 0 and own.max_frequency < 0.0 and own.modes_share == FlexibleSettings.modes_share:
            found.append(b)
    return found


def reference_run(shot: CompiledShot, options: RunSettings, step: float, loads: bool = False) -> ReferenceRun:
    """The shot by its current curves, simulated with all coordinates; arguments as of `simulate_at`."""
    run = by_fast_scheme(options, lambda options: simulate_at(shot, options, step, elastic=True, loads=loads))
    return ReferenceRun(shot.animation, run)


def _told(
    character: Character, bodies: Sequence[ReducedBody], few: Sequence[ReducedBody], error: float
) -> tuple[ReducedBody, ...]:
    """The bodies in fewer coordinates, each with what it does without; the error is of all of them together."""
    fewer = [b for b in range(len(bodies)) if len(few[b].stiffness) < len(bodies[b].stiffness)]
    told = list(few)
    for b in fewer:
        count, left = len(bodies[b].stiffness), len(few[b].stiffness)
        what = f"{character.bodies[b].path}: POD subspace of {left} of {count} elastic coordinates"
        row = Simplification(what, "the shot does not excite the others", error / len(fewer), SUBSPACE)
        others = [other for other in few[b].left_out if other.source != SUBSPACE]
        told[b] = replace(few[b], left_out=(*others, row))
    return tuple(told)
