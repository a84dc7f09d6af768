"""The robots of a retargeting problem together: residuals, derivatives and limited efforts, robot after robot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.parallel import in_parallel
from calmotion.retargeting.problem.ground import ground_of
from calmotion.retargeting.problem.rigid_approximation import EFFORT, effort_of
from calmotion.retargeting.problem.robot import Robot
from calmotion.retargeting.solver.norm import Norm
from calmotion.simulation.forward import limited_values
from calmotion.simulation.inputs.curves import Curves


def joined_residuals(robots: Sequence[Robot]) -> Array:
    """All residuals, robot after robot, shape [S T, R]."""
    return robots[0].stacked if len(robots) == 1 else np.concatenate([robot.stacked for robot in robots])


def squared_errors(robots: Sequence[Robot]) -> float:
    """The sum of the weighted squared errors at the targets."""
    return float(sum(np.sum(robot.residuals**2) for robot in robots))


def tangents(
    robots: Sequence[Robot], values: Array, rates: Array, efforts: bool, ground: bool
) -> tuple[Array, dict[str, Array]]:
    """Changes of all residuals, shape [S T, R], and where wanted of each robot's efforts and the quantities of its
    feet, with the motor curves, shape [T, M] each."""
    found = in_parallel(lambda robot: robot.tangent(values, rates, efforts, ground), robots)
    changes = {effort_of(k): effort for k, (_, effort, _) in enumerate(found)} if efforts else {}
    if ground:
        changes |= {ground_of(k): own for k, (_, _, own) in enumerate(found) if robots[k].ground is not None}
    return found[0][0] if len(found) == 1 else np.concatenate([residuals for residuals, _, _ in found]), changes


def adjoints(robots: Sequence[Robot], residuals: Array, limited: dict[str, Array]) -> tuple[Array, Array]:
    """The transpose of `tangents`: derivatives by the motors' values and rates, shape [T, M] each."""
    parts = np.split(residuals, len(robots))

    def pulled(k: int) -> tuple[Array, Array]:
        return robots[k].adjoint(parts[k], limited.get(effort_of(k)), limited.get(ground_of(k)))

    return _summed(in_parallel(pulled, range(len(parts))))


def continuous_adjoints(robots: Sequence[Robot]) -> tuple[Array, Array]:
    """Derivatives of half the squared residuals by the continuous adjoint."""
    return _summed(in_parallel(Robot.continuous_adjoint, robots))


def further_efforts(robots: Sequence[Robot], curves: Curves) -> dict[str, Array]:
    """Efforts of all robots but the first, by the name of their limit, shape [T, M] each."""
    return {
        effort_of(k): limited_values(robot.model, (EFFORT,), curves, robot.run)[EFFORT]
        for k, robot in enumerate(robots[1:], 1)
    }


def on_ground(robots: Sequence[Robot]) -> dict[str, Array]:
    """The limited quantities of the feet of all robots that have any, by the name of their limit."""
    return {ground_of(k): robot.on_ground() for k, robot in enumerate(robots) if robot.ground is not None}


def reversal_curvatures(robots: Sequence[Robot]) -> dict[str, Array]:
    """Second derivatives of the terms of the play of gears by the efforts of each robot that has any, shape [T, M]
    each, by names that begin as those of its efforts."""
    return {
        f"{effort_of(k)}, reversals": robot.by_effort() for k, robot in enumerate(robots) if robot.reversals is not None
    }


def curved_weights(robots: Sequence[Robot], norm: Norm, weights: Array) -> Array:
    """The weights of residuals, shape [T, K, 6], times the root of their mean second derivatives over the robots."""
    errors = joined_residuals(robots)[:, : weights[0].size]
    squares = np.sum(norm.roots(errors) ** 2, axis=2).reshape(len(robots), *weights.shape)
    shares = np.array([robot.weight for robot in robots])
    return np.asarray(weights * np.sqrt(np.einsum("s,stki->tki", shares, squares)))


def _summed(pulls: Sequence[tuple[Array, Array]]) -> tuple[Array, Array]:
    """The sums of derivatives by values and by rates."""
    if len(pulls) == 1:
        return pulls[0]
    return np.sum([by_value for by_value, _ in pulls], axis=0), np.sum([by_rate for _, by_rate in pulls], axis=0)
