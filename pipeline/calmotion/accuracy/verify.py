"""The error of a result, measured against a finer run of the same curves on the same meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from calmotion.accuracy.integrator_choice import by_fast_scheme
from calmotion.accuracy.pod_subspace import project_to_subspace
from calmotion.accuracy.simulate_to_tolerance import found_tracks
from calmotion.accuracy.step_error import distance, frames_of, simulate_at
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.shot import Animation, Character, FEMeshes, Result
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.inputs.time_grid import MAX_STEP
from calmotion.simulation.prepare import Options, load_envelopes
from calmotion.simulation.simulate import Progress

STEP, TOLERANCE = 0.25, 0.1  # of those of the result
HELD = 0.01  # of its tolerance, that holding the finer run's bodies to what the shot moves may take
FINER, MOST = 0.1, 4  # a reduction that is no finer than the result's is tried again with this share of its tolerance


def verify(
    character: Character, animation: Animation, meshes: FEMeshes | None, reduced: Sequence[ReducedBody] | None,
    result: Result, options: Options, progress: Progress,
) -> tuple[float, float, int]:  # fmt: skip
    """Largest distance of any target, at any frame, to where a finer run has it.

    Args:
        character, animation: The shot; its current curves are those of a result of `simulate`.
        meshes: Of its flexible bodies.
        reduced: The bodies of the result; None where all are rigid.
        options: Those of the result.

    Returns:
        The distance [m], the step of the finer run [s] and its elastic coordinates.

    Raises:
        ShotError: The finer run is not possible.
    """
    if result.after is not None:
        animation = replace(animation, current=found_tracks(result, animation))
    bodies = None
    if reduced is not None and any(body.bends for body in character.bodies):
        allowed = TOLERANCE * character.retarget.allowed(options.tolerance)
        loads = load_envelopes(character, animation, meshes, options)
        reduce = partial(reduce_bodies, character, span_tree(character), meshes, progress, loads)
        bodies = reduce(tolerance=allowed)
        for _ in range(MOST):
            if _coordinates(bodies) > _coordinates(reduced):
                break
            allowed *= FINER
            bodies = reduce(tolerance=allowed)
    progress(0.5, "simulating with a finer step")
    least = HELD * character.retarget.allowed(options.tolerance)
    held = project_to_subspace(character, animation, bodies, options, MAX_STEP, lambda known: least)
    step = STEP * result.step_s
    fine = by_fast_scheme(options, lambda options: simulate_at(character, animation, held.bodies, options, step))
    own = frames_of(result, animation.frame_times)
    return distance(own.positions, fine.positions), fine.step, _coordinates(bodies or ())


def _coordinates(bodies: Sequence[ReducedBody]) -> int:
    """Elastic coordinates of all bodies."""
    return sum(len(body.stiffness) for body in bodies)
