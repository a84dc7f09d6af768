"""Comparison of the integrators: orders, and a stiff nonlinear scene.

`calmotion bench integrators` measures

- errors of positions and velocities against the step, on a flexible arm with a driven joint, against RK4 at a
  fine step;
- the outcome for two thin steel links in a fast motion at the working step: RK4 fails at once, even
  with steps thousands of times smaller, Newmark fails later, BDF2 runs to the end.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from calmotion.model import Animation, Character, FEMeshes
from calmotion.testing import beam_arm, quintic, shot_of

from ..common.reporting import bench_parser, cells_of, finish, heads_of, keep, show

WORKING_STEP = 1.0 / 240.0
SHORT = 0.1  # run time [s]
RK4_PARTS = (1, 1000, 4000)  # of the working step
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


@dataclass(frozen=True)
class Fate:
    """Outcome of the stiff scene: `ends_s` is its duration where it ran to the end."""

    integrator: str
    step_s: float
    outcome: str
    ends_s: float
    wall_s: float


class Scene:
    """A shot whose bodies are reduced once, to be simulated at any step by any integrator."""

    def __init__(self, made: tuple[Character, FEMeshes], animation: Animation):
        from calmotion.simulation import BodyReduction, compile_shot

        self.animation = animation
        self.compiled = compile_shot(made[0], animation, BodyReduction(*made, None).bodies(None))

    def run(self, step: float, integrator: str, seconds: float | None = None) -> Any:
        """A `ForwardRun`, of the first seconds alone where they are given.

        Raises:
            SimulationFailure: It did not come to the end.
        """
        from calmotion.model import RunSettings
        from calmotion.multibody import Workspace
        from calmotion.simulation import prepare, run_forward, sample_tracks

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


def stiff_scene() -> Scene:
    """Two steel links of 200 x 3 x 3 mm, both lifted by 86 degrees in 0.3 s with 150 g at the end, without damping."""
    made = beam_arm(
        links=2, length=0.2, thickness=0.003, youngs_modulus=2.1e11, density=7800.0, payload=0.15, damping=0.0,
        elasticity="stvk", modes=8, cells=10,
    )  # fmt: skip
    return Scene(made, shot_of(quintic(1.5, 0.3), 2.0, 2))


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


def fates(scene: Scene, parts: Sequence[int] = RK4_PARTS) -> list[Fate]:
    """Outcome of the stiff scene."""
    from calmotion.multibody import SimulationFailure

    cases: list[tuple[str, float, float | None]] = [(name, WORKING_STEP, None) for name in SECOND_ORDER]
    cases += [("rk4", WORKING_STEP / part, 0.1) for part in parts]
    found: list[Fate] = []
    for integrator, step, seconds in cases:
        begin, outcome, end = time.perf_counter(), "runs to the end", seconds or float(scene.animation.frame_times[-1])
        try:
            run = scene.run(step, integrator, seconds)
            if run.trajectory.refined:
                outcome = f"needs {len(run.trajectory.refined)} smaller steps"
        except SimulationFailure as failure:
            outcome, end = failure.reason, failure.time_s
        found.append(Fate(integrator, step, outcome, end, time.perf_counter() - begin))
    return found


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("integrators", __doc__)
    options = parser.parse_args(arguments)
    measured, outcomes = orders(arm_scene()), fates(stiff_scene())
    keep(options, Measured, measured)
    errors = {"position": "position_error_m", "velocity": "velocity_error"}
    names = dict.fromkeys(row.integrator for row in measured)
    found = {one: {name: order_of(measured, one, error) for name, error in errors.items()} for one in names}
    lines = [
        f"order of {one}: position {own['position']:.2f}, velocity {own['velocity']:.2f}" for one, own in found.items()
    ]
    stiff = [vars(fate) for fate in outcomes]
    finish(options, "Errors of a flexible arm", measured, lines=lines, orders=found, stiff=stiff)
    if not options.json:
        show("Two thin steel links", heads_of(Fate), [cells_of(fate) for fate in outcomes])
    return 0
