"""One forward simulation of a character's motor curves, and what its targets do in it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.integrate import integrate
from calmotion.multibody.integrators.trajectory import Trajectory
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, start_angles
from calmotion.shot.character import Array
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.inputs.curves import Curves


@dataclass(frozen=True, eq=False)
class ForwardRun:
    """One forward simulation and what the targets do in it.

    `floquet_multiplier` is the largest of the periodic motion, 0 for a shot that plays once.
    """

    trajectory: Trajectory
    joint_angles: Array
    joint_rates: Array
    target_positions: Array
    target_rotations: Array
    floquet_multiplier: float = 0.0


def run_forward(
    model: Model, workspace: Workspace, angles: Array, rates: Array, h: float, world: Array | None = None,
    progress: Callable[[float], None] | None = None, integrator: str = "bdf2", steady: SteadyState | None = None,
) -> ForwardRun:  # fmt: skip
    """Simulate motor curves, from rest or in a loop.

    Args:
        angles, rates: Of the motors, shape [T, M] [rad, rad/s].
        h: Step [s].
        world: Moving roots, see `roots.sample_roots`.
        integrator: One of `calmotion.shot.run.INTEGRATORS`.
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
    floquet_multiplier = 0.0 if steady is None else steady.floquet_multiplier
    return ForwardRun(trajectory, joint_angles, joint_rates, positions, rotations, floquet_multiplier)


def limited_values(model: Model, names: Collection[str], curves: Curves, run: ForwardRun) -> dict[str, Array]:
    """The quantities that limits are about, by name, shape [T, M] each.

    Args:
        names: Which of `limits.QUANTITIES`.
        curves: Of the motors, as simulated.
        run: The simulation.
    """
    found = {"position": curves.angles, "velocity": curves.rates, "acceleration": curves.accelerations}
    if "effort" in names:
        efforts = reactions(model.system, run.trajectory, run.joint_angles, run.joint_rates).efforts
        found["effort"] = model.motor_values(efforts)
    return {name: found[name] for name in names}
