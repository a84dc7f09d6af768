"""Reduced bodies fine enough for a simulation: finer until the motion no longer changes, then on finer meshes.

What a reduction leaves out is estimated for each body by itself, at rest. In a robot that shakes it also shifts
frequencies, and a small shift makes the motions part in time; only the simulation itself tells by how much.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from calmotion.model.character import with_settings
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.multibody.parallel import in_parallel
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.simulation.body_reduction import BodyReduction
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.time_grid import MAX_STEP
from calmotion.tolerance.meshes.mesh_budget import OF_UNCERTAINTY, mesh_error, meshes_to_tolerance, uncertainty_error
from calmotion.tolerance.pod_subspace import ReferenceRun, reference_run
from calmotion.tolerance.reduced_bodies import ConvergedReduction
from calmotion.tolerance.simulation import OF_SHAKE, intended_positions
from calmotion.tolerance.step_error import distance

SHARE = 0.4  # of the tolerance, that what is left out may take
PAIRS = 0.1  # of the tolerance: a reduction finer than this sees pairs of coordinates as for this
FINER, MOST = 0.1, 6  # each tolerance of the reduction over the last, and how many there are
OF_MESH = 0.3  # of the error of meshes that cannot keep their share: a finer reduction would not improve the result


def converged_reduction(
    shot: CompiledShot, reduction: BodyReduction, options: RunSettings,
    progress: Callable[[float, str], None] = lambda fraction, message: None, *, retargeted: bool = False,
) -> ConvergedReduction:  # fmt: skip
    """Refine meshes and bodies of a shot as animated until that moves no target by more than the tolerance.

    Args:
        shot: With the bodies of a first reduction, to the tolerance.
        reduction: Which made them.
        options: With the tolerance.
        retargeted: The shot's shake will be taken away: a twentieth of it may change as well, as what is left of it
            afterwards is known far better.

    Raises:
        ShotError: A body cannot be reduced, or the shot not be simulated.
    """
    refined = _Refinement(shot, options, retargeted, progress)
    reduction = reduction.with_directions(refined.loads())
    refined.refine(reduction)
    # Meshes come second: most reductions are made on the first ones, which are some times smaller.
    if refined.limit_m <= refined.allowed:
        known = refined.known().run
        meshed, finer = meshes_to_tolerance(
            refined.shot, reduction, options, known, progress, refined.bodies, retargeted=retargeted
        )
        if finer is not reduction:
            reduction, refined.shot, refined.found = finer, meshed, None
            if refined.off > refined.allowed:
                refined.refine(reduction)
    reduction.release()
    shot, found = refined.shot, refined.known()
    off = max(refined.off, refined.limit_m)
    free = _with_modes_by_tolerance(reduction)
    if free is not None:  # what authored modes leave out, which no finer tolerance brings back
        progress(1.0, "the same with modes by the tolerance")
        other = shot.with_bodies(free.bodies(FINER * tolerance_of(shot.character, options.tolerance)))
        off = max(off, distance(_simulated(options, other)[0].run.positions, found.run.positions))
    return ConvergedReduction(shot, off, found, reduction)


class _Refinement:
    """A shot whose bodies are reduced to smaller and smaller tolerances.

    Args:
        shot: With the bodies of a first reduction, to the tolerance of the options.
        options, retargeted, progress: As of `converged_reduction`.

    Attributes:
        shot: With the bodies that are finest so far.
        found: This shot as animated; None where it was not simulated.
        off: How far the last refinement moved a target [m].
        allowed: How far it may [m].
    """

    def __init__(
        self, shot: CompiledShot, options: RunSettings, retargeted: bool, progress: Callable[[float, str], None]
    ):
        self._options, self._retargeted, self._progress = options, retargeted, progress
        self._requested = self._tolerance = tolerance_of(shot.character, options.tolerance)
        self._tried, self._counts_shake = 0, retargeted
        self.shot, self.off, self.allowed = shot, 0.0, SHARE * self._requested
        self.found: ReferenceRun | None = None

    @property
    def limit_m(self) -> float:
        """Estimated error that no finer reduction takes away [m]."""
        return sum(body.limit_m for body in self.shot.bodies)

    def known(self) -> ReferenceRun:
        """The shot as animated."""
        self.found = self.found or _simulated(self._options, self.shot)[0]
        return self.found

    def loads(self) -> Sequence[LoadEnvelope]:
        """Those on each body in the shot as animated, which is simulated for them."""
        self.found = reference_run(self.shot, self._options, self._options.step or MAX_STEP, loads=True)
        return self.found.run.loads

    def bodies(self, reduction: BodyReduction) -> list[ReducedBody]:
        """The bodies of a reduction to the tolerance that the shot has so far."""
        return self._reduced(reduction, self._tolerance, self._progress)

    def refine(self, reduction: BodyReduction) -> None:
        """Take finer bodies until these move no target by more than is allowed, or something else is worse."""
        tolerance = self._tolerance
        while self._tried < MOST and self.limit_m <= self.allowed:
            self._tried += 1
            self._progress(self._tried / (MOST + 1), f"a reduction to {1e3 * tolerance:.2g} mm")
            tolerance *= FINER
            bodies = self._reduced(reduction, tolerance)
            if _same(self.shot.bodies, bodies):
                continue
            self._tolerance = tolerance
            self._compare(self.shot.with_bodies(bodies))
            if self.off <= self.allowed or (self._tried > 1 and self._meshes_are_worse()):
                return

    def _reduced(
        self, reduction: BodyReduction, tolerance: float, progress: Callable[[float, str], None] | None = None
    ) -> list[ReducedBody]:
        # what quadratic strain does not see has a bound of its own, and seeing all of it costs most of the time
        return reduction.bodies(tolerance, max(1.0, PAIRS * self._requested / tolerance), progress)

    def _compare(self, finer: CompiledShot) -> None:
        before, then = self.known(), *_simulated(self._options, finer)
        if then.run.integrator != before.run.integrator:  # it gave way for one of them, which differs by more
            self._options = replace(self._options, integrator=self._options.scheme)
            before, then = _simulated(self._options, self.shot, finer)
        self.off = distance(then.run.positions, before.run.positions)
        if self._counts_shake:
            self._counts_shake = False
            shake = distance(before.run.positions, intended_positions(self.shot, self._options))
            self.allowed = max(self.allowed, OF_SHAKE * shake)
        self.shot, self.found = finer, then
        if self.off > self.allowed:
            self.allowed = max(self.allowed, OF_UNCERTAINTY * uncertainty_error(finer, self._options, then.run))

    def _meshes_are_worse(self) -> bool:
        if self._retargeted:
            return False
        return self.off <= OF_MESH * (mesh_error(self.shot, self._options, self.known().run) or 0.0)


def _simulated(options: RunSettings, *shots: CompiledShot) -> list[ReferenceRun]:
    return in_parallel(lambda shot: reference_run(shot, options, options.step or MAX_STEP), shots)


def _with_modes_by_tolerance(reduction: BodyReduction) -> BodyReduction | None:
    """The reduction without authored numbers and frequencies of modes; None where there are none."""
    flexible = [body.flexible for body in reduction.character.bodies if body.flexible is not None]
    if all(own.mode_count < 0 and own.max_frequency < 0.0 for own in flexible):
        return None
    character = with_settings(reduction.character, lambda own: replace(own, mode_count=-1, max_frequency=-1.0))
    return BodyReduction(character, reduction.meshes, reduction.loads)


def _same(one: Sequence[ReducedBody], other: Sequence[ReducedBody]) -> bool:
    """Whether two reductions are of the same coordinates and laws."""
    return all(
        np.array_equal(a.stiffness, b.stiffness)
        and (a.elasticity is None) == (b.elasticity is None)
        and (a.elasticity is None or b.elasticity is None or a.elasticity.law == b.elasticity.law)
        for a, b in zip(one, other, strict=True)
    )
