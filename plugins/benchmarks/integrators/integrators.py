"""Orders of the integrators.

`calmotion bench integrators` measures errors of positions and velocities against the step, on a flexible arm with a
driven joint, against RK4 at a fine step.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from calmotion.model import Animation, Character, FEMeshes, RunSettings
from calmotion.multibody import Workspace
from calmotion.simulation import BodyReduction, compile_shot, prepare, run_forward, sample_tracks
from calmotion.testing import beam_arm, quintic, shot_of

from ..common.reporting import bench_parser, finish, keep

SHORT = 0.1  # run time [s]
SECOND_ORDER = ("bdf2", "newmark", "generalized-alpha")
# steps in a sample of the motion; explicit steps must resolve the fastest mode
STEPS: dict[str, tuple[int, ...]] = {name: (8, 16, 32, 64) for name in SECOND_ORDER}
STEPS |= {"rk4": (32, 64, 128)}
# a motion that starts a little later starts from rest, as its spline rings before it; and one that is sampled densely
# has small jumps of its third derivative, whose waves only small steps resolve
RATE, LATER = 60.0, 0.25
FINEST = 512


@dataclass(frozen=True)
class Measured:
    """One simulation against the reference: largest error of the target [m], of any velocity [m/s, rad/s], and time."""

    integrator: str
    step_s: float
    position_error_m: float
    velocity_error: float
    wall_s: float


class Scene:
    """A shot whose bodies are reduced once, to be simulated at any step by any integrator."""

    def __init__(self, made: tuple[Character, FEMeshes], animation: Animation):
        self.animation = animation
        self.compiled = compile_shot(made[0], animation, BodyReduction(*made, None).bodies(None))

    def run(self, step: float, integrator: str, seconds: float | None = None) -> Any:
        """A `ForwardRun`, of the first seconds alone where they are given.

        Raises:
            SimulationFailure: It did not come to the end.
        """
        options = RunSettings(step=step, pre_roll=0.0, integrator=integrator)
        prepared = prepare(self.compiled, options)
        angles, rates = sample_tracks(self.animation.tracks, prepared.grid)
        last = None if seconds is None else round(seconds / prepared.grid.h) + 1
        workspace = Workspace.for_system(prepared.model.system)
        world = prepared.world[:last]
        return run_forward(
            prepared.model, workspace, angles[:last], rates[:last], prepared.grid.h, world, integrator=integrator
        )


def arm_scene() -> Scene:
    """A flexible arm on a driven joint, a quarter turn in half a second."""
    move = quintic(np.pi / 2, 0.5, LATER)
    return Scene(beam_arm(modes=3, elasticity="linear"), shot_of(move, LATER + 0.75, rate=RATE))


def orders(scene: Scene, steps: dict[str, tuple[int, ...]] = STEPS, finest: int = FINEST) -> list[Measured]:
    """Errors at the samples of the motion, by integrator and step.

    Args:
        steps: Steps in a sample, by integrator.
        finest: Those of the reference.
    """
    frame = float(scene.animation.frame_times[1])
    reference = scene.run(frame / finest, "rk4")
    found = []
    for integrator, counts in steps.items():
        scene.run(frame / counts[0], integrator, 2.0 * frame)  # compiles
        for count in counts:
            run = scene.run(frame / count, integrator)
            # a short run is timed more often, and the least disturbed one counts
            again = [] if run.trajectory.wall_s > SHORT else [scene.run(frame / count, integrator) for _ in range(2)]
            wall = min(item.trajectory.wall_s for item in (run, *again))
            off = run.target_positions[::count] - reference.target_positions[::finest]
            V, exact = run.trajectory.states.V[::count], reference.trajectory.states.V[::finest]
            found.append(
                Measured(
                    integrator=integrator,
                    step_s=frame / count,
                    position_error_m=float(np.linalg.norm(off, axis=2).max()),
                    velocity_error=float(np.abs(V - exact)[1:].max()),
                    wall_s=wall,
                )
            )
    return found


def order_of(rows: Sequence[Measured], integrator: str, error: str = "position_error_m") -> float:
    """Order of an integrator: the largest slope between neighbouring steps.

    Coarse steps do not resolve everything yet, and errors of fine ones reach that of the reference.
    """
    own = [row for row in rows if row.integrator == integrator]
    steps, errors = np.log([row.step_s for row in own]), np.log([getattr(row, error) for row in own])
    return float(np.max(np.diff(errors) / np.diff(steps)))


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("integrators", __doc__)
    options = parser.parse_args(arguments)
    measured = orders(arm_scene())
    keep(options, Measured, measured)
    errors = {"position": "position_error_m", "velocity": "velocity_error"}
    names = dict.fromkeys(row.integrator for row in measured)
    found = {one: {name: order_of(measured, one, error) for name, error in errors.items()} for one in names}
    lines = [
        f"order of {one}: position {own['position']:.2f}, velocity {own['velocity']:.2f}" for one, own in found.items()
    ]
    finish(options, "Errors of a flexible arm", measured, lines=lines, orders=found)
    return 0
