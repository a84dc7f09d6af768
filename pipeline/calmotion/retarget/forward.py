"""One forward simulation of a character's motor curves, and what its targets do in it."""

from __future__ import annotations

from dataclasses import dataclass

from ..dynamics.integrators import integrate
from ..dynamics.kinematics import rigid_state, target_frames
from ..dynamics.model import Model, start_angles
from ..dynamics.simulation import Trajectory, Workspace
from ..shot.character import Array
from .steady import SteadyState


@dataclass(frozen=True, eq=False)
class ForwardRun:
    """One forward simulation and what the targets do in it."""

    trajectory: Trajectory
    joint_angles: Array
    joint_rates: Array
    target_positions: Array
    target_rotations: Array


def run_forward(
    model: Model, workspace: Workspace, angles: Array, rates: Array, h: float, world: Array | None = None,
    progress=None, integrator: str = "bdf2", steady: SteadyState | None = None,
) -> ForwardRun:  # fmt: skip
    """Simulate motor curves, from rest or in a loop.

    Args:
        angles, rates: Of the motors, shape [T, M] [rad, rad/s].
        h: Step [s].
        world: Moving roots, see `roots.sample_roots`.
        integrator: One of `integrators.INTEGRATORS`.
        steady: Finds the motions of a shot that loops.
    """
    joint_angles, joint_rates = model.joint_angles(angles), model.joint_angles(rates)
    if steady is not None:
        trajectory = steady.find(joint_angles, joint_rates)
    else:
        start = rigid_state(model, start_angles(model, joint_angles[0]), None if world is None else world[0])
        trajectory = integrate(
            model.system, start, joint_angles, joint_rates, h, workspace, progress, integrator=integrator, world=world
        )
    states = trajectory.states
    positions, rotations = target_frames(model, states.c, states.q, states.u)
    return ForwardRun(trajectory, joint_angles, joint_rates, positions, rotations)
