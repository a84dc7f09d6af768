"""Error and cost of the gradients of both adjoints, against differences."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from calmotion.benchmarks.common.shots import BenchShot
from calmotion.benchmarks.common.timing import median_time
from calmotion.benchmarks.optimizer.optimizer import make_problem
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.shot.character import Array
from calmotion.shot.run import RunSettings
from calmotion.simulation.prepare import prepare

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


def _differences(problem: RetargetProblem, directions: Array) -> tuple[Array, float]:
    """Derivatives along directions by central differences, extrapolated (Richardson), and how far two such disagree."""
    zero = np.zeros(problem.size)

    def central(d: Array, e: float) -> float:
        return (problem.value(zero + e * d) - problem.value(zero - e * d)) / (2.0 * e)

    found, other = [], []
    for d in directions:
        wide, middle, close = (central(d, SIZE / k) for k in (1, 2, 4))
        found.append((4.0 * middle - wide) / 3.0)
        other.append((4.0 * close - middle) / 3.0)
    values = np.array(found)
    return values, float(np.max(np.abs(values - other)) / np.max(np.abs(values)))


def errors(shot: BenchShot, steps: tuple[int, ...] = STEPS) -> list[GradientError]:
    """Both adjoints of one shot at all steps."""

    def problem_at(divided: float) -> RetargetProblem:
        prepared = prepare(shot.compiled, RunSettings(step=COARSEST / divided))
        return make_problem(shot, prepared, 0.1)

    rng = np.random.default_rng(1)
    finest = problem_at(FINER * steps[-1])
    directions = rng.normal(size=(DIRECTIONS, finest.size))
    judge, _ = _differences(finest, directions)
    scale = float(np.max(np.abs(judge)))
    rows = []
    for divided in steps:
        problem = problem_at(divided)
        same, floor = _differences(problem, directions)
        forward = median_time(partial(problem.value, np.zeros(problem.size)), REPEATS)
        for name, gradient in (("discrete", problem.linearize), ("continuous", problem.continuous_gradient)):
            found, seconds = directions @ gradient(), median_time(gradient, REPEATS)
            off, fine = (float(np.max(np.abs(found - values))) / scale for values in (same, judge))
            rows.append(GradientError(shot.name, name, problem.grid.h, forward, seconds, off, fine, floor))
    return rows
