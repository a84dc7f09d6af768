"""The rigid robot as an approximation of the flexible one: gradient and preconditioner without a simulation."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array
from calmotion.multibody.analysis.rigid_response import RigidResponse
from calmotion.multibody.model.model import Model, rigid_model
from calmotion.multibody.model.moving_markers import rooted
from calmotion.retargeting.problem.ground import GROUND
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.simulation.inputs.curves import Curves
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.intended_motion import rigid_motion

EFFORT = "effort"
STRIDE = 8  # instants from one rigid response to the next


def effort_of(robot: int) -> str:
    """The name of the efforts of one of the robots of a problem."""
    return f"{EFFORT} of robot {robot}" if robot else EFFORT


def rigid_response(model: Model, grid: TimeGrid, curves: Curves, world: Array | None, coupling: Array) -> RigidResponse:
    """Motion of the targets and efforts of the motors of the rigid robot, by the motors that may change.

    Args:
        model: The flexible character.
        grid: Its time grid.
        curves: The animator's curves.
        world: Moving roots, or None.
        coupling: By how much each motor changes with each that may change, shape [M, m].
    """
    rigid = rigid_model(model)
    motion = rigid_motion(rigid, curves.angles, curves.rates, grid.h, world, grid.cyclic)
    angles = model.joint_angles(curves.angles)
    roots, moved = rooted(world, len(motion.c)), np.flatnonzero(np.any(coupling, axis=1)).astype(np.int32)
    times = grid.h * np.arange(len(angles), dtype=np.float64)
    response = RigidResponse.along(rigid, motion.c, motion.q, angles, moved, roots, times, STRIDE)
    return response.coupled(coupling[moved])


def rigid_gradient(response: RigidResponse, space: OffsetSpace, weights: Array, residuals: Array) -> Array:
    """Gradient of the errors if the robot were rigid: an offset acts at its own instant alone.

    Args:
        response: Of the rigid robot.
        space: The unknowns.
        weights, residuals: Of the targets, shape [T, K, 6].
    """
    pulls = np.einsum("nkim,nki->nm", response.targets, weights * residuals)
    return np.asarray(space.basis.values.T @ pulls).ravel()


def limit_metrics(inertia: Array, space: OffsetSpace, curvatures: dict[str, Array]) -> list[tuple[csr_matrix, Array]]:
    """Terms of the active limits in the Gauss-Newton matrix of the rigid robot; efforts are inertia times acceleration.

    Args:
        inertia: Efforts by accelerations of the unknowns' motors, shape [T, M, m].
        space: The unknowns.
        curvatures: Second derivatives of the limits' terms by quantity, shape [T, M].
    """
    metrics = []
    for name, weight in curvatures.items():
        if not np.any(weight) or name.startswith(GROUND):  # feet have few limits that act
            continue
        if name.startswith(EFFORT):
            metrics.append((space.basis.accelerations, np.einsum("nma,nm,nmb->nab", inertia, weight, inertia)))
        else:
            product = np.einsum("ma,nm,mb->nab", space.coupling, weight, space.coupling)
            metrics.append((space.splines[name], product))
    return metrics
