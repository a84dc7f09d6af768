"""The error of a result, measured against a finer run of the same curves on finer meshes."""

from collections.abc import Sequence

from calmotion.model import Result
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
from calmotion.tolerance.step_error import distance, frames_of_result, simulate_at

STEP, TOLERANCE, MESH = 0.25, 0.1, 0.25  # of those of the result, and of the error of its meshes
NODES = 30_000  # of the finer meshes
PROJECTION = 0.01  # share of the tolerance for the error of the POD subspaces of the finer run
FINER, MOST = 0.1, 4  # a reduction that is no finer than the result's is tried again with this share of its tolerance


def verify(
    shot: CompiledShot, reduction: BodyReduction | None, result: Result, options: RunSettings, progress: Progress
) -> Verification:
    """Largest distance of any target, at any frame, to where a finer run has it.

    Args:
        shot: With the bodies of the result; its current curves are those of a result of `simulate`.
        reduction: Makes its bodies again, finer; None where all are rigid.
        result: Of `simulate` or `optimize`.
        options: Those of the result.

    Raises:
        ShotError: The finer run is not possible.
    """
    if result.after is not None:
        shot = shot.with_tracks(found_tracks(result, shot.animation))
    if reduction is not None:
        shot = shot.with_bodies(_finer(shot, reduction, options, progress))
    progress(0.5, "simulating with a finer step")
    least = PROJECTION * tolerance_of(shot.character, options.tolerance)
    projected = project_to_subspace(shot, options, MAX_STEP, lambda known: least)
    step = STEP * result.step_s
    fine = by_fast_scheme(options, lambda options: simulate_at(projected.shot, options, step))
    meshes = mesh_error(projected.shot, options, fine) or 0.0
    own = frames_of_result(result, shot.animation.frame_times)
    return Verification(distance(own.positions, fine.positions), fine.step, _coordinates(shot.bodies), meshes)


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
