"""One forward simulation of a character's motor curves, and what its targets do in it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cached_property

from calmotion.arrays import Array, IntArray
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.reactions import Reactions, reactions
from calmotion.multibody.integrators.pieces import integrate_in_pieces
from calmotion.multibody.integrators.trajectory import Trajectory
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, start_angles
from calmotion.multibody.runs import frames_in, from_rest
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.inputs.curves import Curves
from calmotion.simulation.inputs.delays import CommandDelay

AT_ONCE = 8192  # instants of a simulation, or of what follows from it, that are held at once


@dataclass(frozen=True, eq=False)
class ForwardRun:
    """One forward simulation and what the targets do in it.

    Attributes:
        joint_angles, joint_rates: What the joints' motors follow, shape [T, J]: commands that are delayed.
        commands: The motors' curves, shape [T, M] [rad].
        floquet_multiplier: Largest of the periodic motion, 0 for a shot that plays once.
    """

    trajectory: Trajectory
    joint_angles: Array
    joint_rates: Array
    target_positions: Array
    target_rotations: Array
    commands: Array
    floquet_multiplier: float = 0.0


def reactions_at(model: Model, run: ForwardRun, instants: IntArray | slice) -> Reactions:
    """What the joints transmit at some instants of a run."""
    return reactions(model.system, run.trajectory, run.joint_angles, run.joint_rates, instants)


def run_forward(
    model: Model, workspace: Workspace, angles: Array, rates: Array, h: float, world: Array | None = None,
    progress: Callable[[float], None] | None = None, integrator: str = "bdf2", steady: SteadyState | None = None,
) -> ForwardRun:  # fmt: skip
    """Simulate motor curves, from rest or in a loop.

    Args:
        angles, rates: Of the motors, shape [T, M] [rad, rad/s].
        h: Step [s].
        world: Moving roots, see `roots.sample_roots`.
        integrator: One of `calmotion.model.run.INTEGRATORS`.
        steady: Finds the motions of a shot that loops.
    """
    joint_angles, joint_rates = followed(model, angles, rates, h, steady is not None)
    if steady is not None:
        trajectory = steady.find(joint_angles, joint_rates)
    else:
        trajectory = from_rest(model, joint_angles, joint_rates, h, workspace, integrator, world, progress)
    frames, multiplier = frames_in(model, trajectory), 0.0 if steady is None else steady.floquet_multiplier
    return ForwardRun(trajectory, joint_angles, joint_rates, *frames, angles, multiplier)


def run_in_pieces(
    model: Model, workspace: Workspace, angles: Array, rates: Array, h: float, world: Array | None,
    integrator: str, size: int, divides: bool = True,
) -> Iterator[tuple[slice, ForwardRun]]:  # fmt: skip
    """`run_forward` from rest, to the last bit, of which only a piece is held at once.

    Args:
        workspace: Nobody else may use it before the last piece.
        size: Largest number of instants of a piece.
        divides: Whether a step that Newton's method cannot solve is divided into smaller ones.

    Yields:
        The instants of a piece, and the run over them.
    """
    joint_angles, joint_rates = followed(model, angles, rates, h, False)
    start = rigid_state(model, start_angles(model, joint_angles[0]), None if world is None else world[0])
    pieces = integrate_in_pieces(
        model.system, start, joint_angles, joint_rates, h, workspace, integrator, world, size, divides
    )  # fmt: skip
    for rows, trajectory in pieces:
        frames = frames_in(model, trajectory)
        yield rows, ForwardRun(trajectory, joint_angles[rows], joint_rates[rows], *frames, angles[rows])


def followed(model: Model, angles: Array, rates: Array, h: float, cyclic: bool) -> tuple[Array, Array]:
    """Angles and rates that the joints' motors follow, shape [T, J], for curves of shape [T, M]."""
    late = CommandDelay(model.delays, h, cyclic).apply(angles, rates)
    return model.joint_angles(late[0]), model.joint_angles(late[1])


@dataclass(frozen=True, eq=False)
class PerformedCurves:
    """Curves of the motors and the run in which they are performed, as `model.limits` takes them."""

    model: Model
    curves: Curves
    run: ForwardRun

    @property
    def derivatives(self) -> tuple[Array, ...]:
        """Of the curves, shape [T, M] each."""
        return self.curves.derivatives

    @cached_property
    def efforts(self) -> Array:
        """Of the motors in the run, shape [T, M]."""
        found = reactions(self.model.system, self.run.trajectory, self.run.joint_angles, self.run.joint_rates)
        return self.model.motor_values(found.efforts)


def limited_values(model: Model, names: Collection[str], curves: Curves, run: ForwardRun) -> dict[str, Array]:
    """The quantities of some kinds of limits, by name, shape [T, M] each.

    Args:
        names: Which, of `kinds_of_limits`.
        curves: Of the motors, as simulated.
        run: The simulation.
    """
    performed = PerformedCurves(model, curves, run)
    return {name: kinds_of_limits()[name].values(performed) for name in names}
