"""The error of a result, measured against a finer run of the same curves on finer meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from calmotion.model import Result
from calmotion.model.character import contact_joints
from calmotion.model.outputs import Verification
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.simulation.body_reduction import BodyReduction
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.time_grid import MAX_STEP
from calmotion.simulation.simulate import Progress
from calmotion.tolerance.integrator_choice import by_fast_scheme
from calmotion.tolerance.meshes.mesh_budget import mesh_error
from calmotion.tolerance.pod_subspace import project_to_subspace
from calmotion.tolerance.simulation import found_tracks
from calmotion.tolerance.step_error import StepRun, distance, frames_of_result, simulate_at
from calmotion.tolerance.verification.parts_in_time import (
    Elsewhere,
    in_parts,
    joined_positions,
    lead_time,
    parts_in_time,
)

STEP, TOLERANCE, MESH = 0.25, 0.1, 0.25  # of those of the result, and of the error of its meshes
NODES = 30_000  # of the finer meshes
PROJECTION = 0.01  # share of the tolerance for the error of the POD subspaces of the finer run
FINER, MOST = 0.1, 4  # a reduction that is no finer than the result's is tried again with this share of its tolerance


def verify(
    shot: CompiledShot, reduction: BodyReduction | None, result: Result, options: RunSettings, progress: Progress,
    elsewhere: Elsewhere | None = None,
) -> Verification:  # fmt: skip
    """Largest distance of any target, at any frame, to where a finer run has it.

    Args:
        shot: With the bodies of the result; its current curves are those of a result of `simulate`.
        reduction: Makes its bodies again, finer; None where all are rigid.
        result: Of `simulate` or `optimize`.
        options: Those of the result.
        elsewhere: Where parts of a long shot are simulated independently; None: in one piece, here.

    Raises:
        ShotError: The finer run is not possible.
    """
    if result.after is not None:
        shot = shot.with_tracks(found_tracks(result, shot.animation))
    if reduction is not None:
        shot = shot.with_bodies(_finer(shot, reduction, options, progress))
    progress(0.5, "simulating with a finer step")
    step, frame_times = STEP * result.step_s, shot.animation.frame_times
    own, modes = frames_of_result(result, frame_times), _coordinates(shot.bodies)
    parts = () if elsewhere is None else parts_in_time(shot.animation, elsewhere.length, lead_time(shot))
    if elsewhere is None or len(parts) < 2 or shot.character.retarget.cyclic or contact_joints(shot.character):
        fine, meshes = finer_run(shot, options, step)
        return Verification(distance(own.positions, fine.positions), fine.step, modes, meshes)
    runs = in_parts(shot, parts, elsewhere.perform, finer_run, options, step)
    positions, gap = joined_positions(parts, [run.positions for run, _ in runs], float(frame_times[1]))
    error = distance(own.positions, positions)
    return Verification(error, runs[0][0].step, modes, max(meshes for _, meshes in runs), len(parts), gap)


def finer_run(shot: CompiledShot, options: RunSettings, step: float) -> tuple[StepRun, float]:
    """A shot with its finer bodies, and a part of it the same, by a step [s]; the estimated error of its meshes [m]."""
    least = PROJECTION * tolerance_of(shot.character, options.tolerance)
    projected = project_to_subspace(shot, options, MAX_STEP, lambda known: least)
    fine = by_fast_scheme(options, lambda options: simulate_at(projected.shot, options, step))
    meshes = mesh_error(projected.shot, options, fine) or 0.0
    return replace(fine, efforts=None), meshes


def _finer(shot: CompiledShot, reduction: BodyReduction, options: RunSettings, progress: Progress) -> list[ReducedBody]:
    """The bodies on finer meshes, reduced with more coordinates than the shot's."""
    allowed = TOLERANCE * tolerance_of(shot.character, options.tolerance)
    errors = {b: body.mesh_error for b, body in enumerate(shot.bodies) if body.mesh_error}
    wanted = {b: MESH * error for b, error in errors.items() if error is not None}
    if wanted:
        reduction = reduction.with_finer_meshes(options.tolerance, wanted, NODES, progress, keeps="finer")
    for _ in range(1 + MOST):
        bodies = reduction.bodies(allowed, progress=progress)
        if _coordinates(bodies) > _coordinates(shot.bodies):
            break
        allowed *= FINER
    return bodies


def _coordinates(bodies: Sequence[ReducedBody]) -> int:
    """Elastic coordinates of all bodies."""
    return sum(len(body.stiffness) for body in bodies)
