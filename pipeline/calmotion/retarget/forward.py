"""One forward simulation of a character's motor curves, and what its targets do in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..dynamics.integrators import integrate
from ..dynamics.kinematics import rigid_state, target_frames
from ..dynamics.model import Model
from ..dynamics.simulation import Trajectory, Workspace
from ..shot.character import Array, BoolArray


@dataclass(frozen=True, eq=False)
class ForwardRun:
    """One forward simulation and what the targets do in it."""

    trajectory: Trajectory
    joint_angles: Array
    joint_rates: Array
    target_positions: Array
    target_rotations: Array


def moves_freely(model: Model) -> BoolArray:
    """Which joints no motor holds."""
    rows = model.system.rows
    return (rows > 0) & (rows < 6)


def start_angles(model: Model, joint_angles: Array) -> Array:
    """Angles of all joints for the first pose: motors from their tracks, free joints as the shot was authored."""
    free = moves_freely(model)
    return np.where(free, model.rest_angles, joint_angles)


def run_forward(
    model: Model, workspace: Workspace, angles: Array, rates: Array, h: float, world: Array | None = None,
    progress=None, integrator: str = "bdf2",
) -> ForwardRun:  # fmt: skip
    """Simulate motor curves.

    Args:
        angles, rates: Of the motors, shape [T, M] [rad, rad/s].
        h: Step [s].
        world: Moving roots, see `roots.sample_roots`.
        integrator: One of `integrators.INTEGRATORS`.
    """
    joint_angles, joint_rates = model.joint_angles(angles), model.joint_angles(rates)
    start = rigid_state(model, start_angles(model, joint_angles[0]), None if world is None else world[0])
    trajectory = integrate(
        model.system, start, joint_angles, joint_rates, h, workspace, progress, integrator=integrator, world=world
    )
    states = trajectory.states
    positions, rotations = target_frames(model, states.c, states.q, states.u)
    return ForwardRun(trajectory, joint_angles, joint_rates, positions, rotations)
