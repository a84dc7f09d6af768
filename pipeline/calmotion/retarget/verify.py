"""The error of a result, measured against a finer run of the same curves on the same meshes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..dynamics.topology import span_tree
from ..shot import Animation, Character, FEMeshes, Result
from ..shot.character import DEFAULT_TOLERANCE
from .bodies import reduce_bodies
from .prepare import Options, excitations
from .run import Progress
from .step_error import simulate_at
from .to_tolerance import found_tracks

STEP, TOLERANCE = 0.25, 0.1  # of those of the result


def verify(
    character: Character, animation: Animation, meshes: FEMeshes | None, result: Result, options: Options,
    progress: Progress,
) -> tuple[float, float, int]:  # fmt: skip
    """Largest distance of any target, at any frame, to where a finer run has it.

    Args:
        character, animation: The shot; its current curves are those of a result of `simulate`.
        meshes: Of its flexible bodies.
        options: Those of the result.

    Returns:
        The distance [m], the step of the finer run [s] and its elastic coordinates.

    Raises:
        ShotError: The finer run is not possible.
    """
    simulation = result.after or result.before
    if result.after is not None:
        animation = replace(animation, current=found_tracks(result, animation))
    bodies = None
    if any(body.flexible for body in character.bodies):
        allowed = TOLERANCE * (options.tolerance or character.retarget.tolerance or DEFAULT_TOLERANCE)
        loads = excitations(character, animation, meshes, options)
        bodies = reduce_bodies(character, span_tree(character), meshes, progress, loads, allowed)
    progress(0.5, "simulating with a finer step")
    fine = simulate_at(character, animation, bodies, options, STEP * result.step_s)
    at_frames = np.searchsorted(simulation.motion.times, animation.frame_times - 1e-9)
    off = np.linalg.norm(simulation.motion.target_positions[at_frames] - fine.positions, axis=2)
    return float(np.max(off, initial=0.0)), fine.step, sum(len(body.stiffness) for body in bodies or ())
