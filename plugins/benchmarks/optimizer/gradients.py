"""Accuracy and run time of the gradients of both adjoints, against central differences.

`calmotion bench gradients [SHOT ...]` computes the gradient of each shot's objective by the discrete and by the
continuous adjoint at decreasing steps. It compares them with central differences of the whole simulation along random
directions, at the same step (error of the discrete objective) and at a quarter of the smallest step (error of the
continuous objective).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import cycle

import numpy as np
from calmotion.arrays import Array
from calmotion.model import RunSettings
from calmotion.retargeting import Evaluation, RetargetProblem
from calmotion.simulation import CompiledShot, prepare

from ..common.reporting import bench_parser, on_shots
from ..common.shots import SAMPLES
from ..common.timing import median_time
from .optimizer import make_problem

STEPS = (1, 2, 4, 8)  # in a 240th of a second
FINER = 4
COARSEST = 1.0 / 240.0
DIRECTIONS = 3
SIZE = 5e-4  # of an unknown in a difference [rad]
REPEATS = 3


@dataclass(frozen=True)
class GradientError:
    """One adjoint at one step.

    Attributes:
        shot, adjoint: Names.
        step_s: [s].
        forward_s, gradient_s: Median time of a simulation, and of linearising it and going back [s].
        same_step, fine: Largest error of a directional derivative over the largest such derivative, against
            central differences at the same step and at the finest.
        floor: How far two central differences of the same step, one with half the distance, disagree: below this
            nothing is told apart.
    """

    shot: str
    adjoint: str
    step_s: float
    forward_s: float
    gradient_s: float
    same_step: float
    fine: float
    floor: float


def errors(name: str, shot: CompiledShot, steps: tuple[int, ...] = STEPS) -> list[GradientError]:
    """Both adjoints of one shot at all steps."""

    def problem_at(divided: float) -> RetargetProblem:
        return make_problem(shot, prepare(shot, RunSettings(step=COARSEST / divided)), 0.1)

    rng = np.random.default_rng(1)
    finest = problem_at(FINER * steps[-1])
    directions = rng.normal(size=(DIRECTIONS, finest.size))
    judge, _ = _differences(finest, directions)
    scale = float(np.max(np.abs(judge)))
    rows = []
    for divided in steps:
        problem = problem_at(divided)
        same, floor = _differences(problem, directions)
        zero = np.zeros(problem.size)
        forward = median_time(partial(problem.at, zero), REPEATS)
        for adjoint in ("discrete", "continuous"):
            posed = replace(problem, continuous=adjoint == "continuous")

            runs = cycle([posed.at(zero), posed.at(zero)])  # of one run it is worked out once

            def gradient(runs: Iterator[Evaluation] = runs) -> Array:
                at = next(runs)
                return at.of(at.problem).linearized().gradient

            found, seconds = directions @ gradient(), median_time(gradient, REPEATS)
            off, fine = (float(np.max(np.abs(found - values))) / scale for values in (same, judge))
            rows.append(GradientError(name, adjoint, problem.grid.h, forward, seconds, off, fine, floor))
    return rows


def _differences(problem: RetargetProblem, directions: Array) -> tuple[Array, float]:
    """Derivatives along directions by central differences, extrapolated (Richardson), and how far two such disagree."""
    zero = np.zeros(problem.size)

    def central(d: Array, e: float) -> float:
        return float(problem.at(zero + e * d).merit - problem.at(zero - e * d).merit) / (2.0 * e)

    found, other = [], []
    for d in directions:
        wide, middle, close = (central(d, SIZE / k) for k in (1, 2, 4))
        found.append((4.0 * middle - wide) / 3.0)
        other.append((4.0 * close - middle) / 3.0)
    values = np.array(found)
    return values, float(np.max(np.abs(values - other)) / np.max(np.abs(values)))


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    options = bench_parser("gradients", __doc__, SAMPLES[:1]).parse_args(arguments)
    return on_shots(options, "Gradients against central differences", GradientError, errors)
