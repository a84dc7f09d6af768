"""Reduced bodies fine enough for a simulation: finer meshes, then finer reductions until the motion no longer changes.

What a reduction leaves out is estimated for each body by itself, at rest. In a robot that shakes it also shifts
frequencies, and a small shift makes the motions part in time; only the simulation itself tells by how much.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from calmotion.model.character import with_settings
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.multibody.parallel import in_parallel
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
    tolerance = requested = tolerance_of(shot.character, options.tolerance)

    def simulated(*shots: CompiledShot) -> list[ReferenceRun]:
        return in_parallel(lambda shot: reference_run(shot, options, options.step or MAX_STEP), shots)

    found = None if retargeted else simulated(shot)[0]
    known = None if found is None else found.run
    meshed, reduction = meshes_to_tolerance(shot, reduction, options, known, progress)
    if meshed is not shot:
        shot, found = meshed, None
    off, allowed = 0.0, SHARE * requested
    for k in range(MOST):
        progress((k + 1) / (MOST + 1), f"a reduction to {1e3 * tolerance:.2g} mm")
        tolerance *= FINER
        # what quadratic strain does not see has a bound of its own, and seeing all of it costs most of the time
        bodies = reduction.bodies(tolerance, max(1.0, PAIRS * requested / tolerance))
        if _same(shot.bodies, bodies):
            continue
        finer = shot.with_bodies(bodies)
        before, then = simulated(shot, finer) if found is None else (found, *simulated(finer))
        if then.run.integrator != before.run.integrator:  # it gave way for one of them, which differs by more
            options = replace(options, integrator=options.scheme)
            before, then = simulated(shot, finer)
        off = distance(then.run.positions, before.run.positions)
        if retargeted and found is None:
            allowed = max(allowed, OF_SHAKE * distance(before.run.positions, intended_positions(shot, options)))
        shot, found = finer, then
        if off > allowed:
            allowed = max(allowed, OF_UNCERTAINTY * uncertainty_error(shot, options, found.run))
        if off <= allowed or (k and not retargeted and off <= OF_MESH * (mesh_error(shot, options, found.run) or 0.0)):
            break
    reduction.release()
    found = found or simulated(shot)[0]
    free = _with_modes_by_tolerance(reduction)
    if free is not None:  # what authored modes leave out, which no finer tolerance brings back
        progress(1.0, "the same with modes by the tolerance")
        off = max(off, distance(simulated(shot.with_bodies(free.bodies(FINER * requested)))[0].run.positions,
                                found.run.positions))  # fmt: skip
    return ConvergedReduction(shot, off, found, reduction)


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
