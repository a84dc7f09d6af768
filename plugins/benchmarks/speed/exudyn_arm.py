"""The swung arm with reduced flexible bodies of Exudyn and of Calmotion: run time against error.

0.6 m of plastic, 20 mm square, a rigid cube of 0.2 kg at its end; a quarter turn in half a second, and half a second
after it; no gravity, damping in proportion to stiffness. Six interface modes and eight more on both sides, the same
mesh, one thread. Each is measured against itself with a fine step, so that only the error in time counts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.testing import beam_arm, quintic, shot_of

from ..integrators.integrators import Scene
from ..scenes.exudyn_arm import ExudynArm as Arm

DURATION, SAMPLES = 1.0, 24
STEPS, FINE = (240, 480, 960, 1920), 15360
LEVELS = (1e-4, 1e-5)  # errors of the tip [m] at which run times are compared


@dataclass(frozen=True)
class Run:
    """One simulation: steps, largest error of the tip at the samples, and run time [s]."""

    code: str
    steps: int
    error_m: float
    wall_s: float


def quarter_turn(t: float) -> float:
    """The motion of the comparison [rad]."""
    s = min(2.0 * t, 1.0)
    return 0.5 * np.pi * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


class Exudyn(Arm):
    """The arm in Exudyn, in the motion of the comparison."""

    def run(self, steps: int) -> tuple[Array, float]:
        """Tip at the samples [m], shape [s, 3], and the run time [s]."""
        done = self.performed(steps, quarter_turn, DURATION, SAMPLES)
        return done.positions, done.wall_s


class Ours:
    """The arm here, by one integrator."""

    def __init__(self, integrator: str):
        character, meshes = beam_arm(
            length=Arm.LENGTH,
            thickness=Arm.THICKNESS,
            payload=Arm.PAYLOAD,
            modes=6 + Arm.FIXED_MODES,
            elasticity="linear",
            gravity=0.0,
            cells=Arm.CELLS,
        )
        settings = character.bodies[0].flexible
        assert settings is not None
        link = replace(character.bodies[0], flexible=replace(settings, material=Arm.MATERIAL))
        character = replace(character, bodies=(link, *character.bodies[1:]))
        # sampled so densely that the spline is the quintic
        self.scene = Scene((character, meshes), shot_of(quintic(0.5 * np.pi, 0.5), DURATION, rate=240.0))
        self.integrator = integrator
        self.scene.run(DURATION / 240, integrator, 0.1)  # compiles

    def run(self, steps: int) -> tuple[Array, float]:
        """Tip at the samples [m], shape [s, 3], and the run time [s]."""
        run = self.scene.run(DURATION / steps, self.integrator)
        return run.target_positions[:: steps // SAMPLES, 0][1:], run.trajectory.wall_s


def compare(repeats: int = 3) -> list[Run]:
    """Work and precision of Exudyn and of ours."""
    codes: dict[str, Any] = {"exudyn": Exudyn()}
    codes |= {f"ours, {name}": Ours(name) for name in ("bdf2", "generalized-alpha")}
    results = []
    for name, code in codes.items():
        exact, _ = code.run(FINE)
        for steps in STEPS:
            runs = [code.run(steps) for _ in range(repeats)]
            error = float(np.linalg.norm(runs[0][0] - exact, axis=1).max())
            results.append(Run(name, steps, error, float(np.median([wall for _, wall in runs]))))
    return results


def time_at(runs: list[Run], code: str, error: float) -> float:
    """Run time of a code at an error [s], by interpolation (or continuation) of logarithms."""
    selected = sorted((run for run in runs if run.code == code), key=lambda run: run.error_m)
    errors, walls = np.log([run.error_m for run in selected]), np.log([run.wall_s for run in selected])
    slope = np.polyfit(errors, walls, 1)
    return float(np.exp(np.polyval(slope, np.log(error))))
