"""One forward simulation of a character's motor curves, and what its targets do in it."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property

from calmotion.arrays import Array, IntArray
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.multibody.analysis.reactions import Reactions, reactions
from calmotion.multibody.integrators.trajectory import Trajectory
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model
from calmotion.multibody.runs import frames_in, from_rest
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.inputs.curves import CommandDelay, Curves


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
    divides: bool = True, divided: IntArray | None = None,
) -> ForwardRun:  # fmt: skip  # parameters: a model, its inputs, how it is stepped
    """Simulate motor curves, from rest or in a loop.

    Args:
        angles, rates: Of the motors, shape [T, M] [rad, rad/s].
        h: Step [s].
        world: Moving roots, see `roots.sample_roots`.
        integrator: One of `calmotion.model.run.INTEGRATORS`.
        steady: Finds the motions of a shot that loops.
        divides: Whether a step that cannot be solved is divided into smaller ones, where the shot does not loop.
        divided: Into how many parts each step is, shape [T], 0: as the friction of servos needs it; None: into none.
    """
    joint_angles, joint_rates = followed(model, angles, rates, h, steady is not None)
    if steady is not None:
        trajectory = steady.find(joint_angles, joint_rates)
    else:
        trajectory = from_rest(
            model, joint_angles, joint_rates, h, workspace, integrator, world, progress, divides, divided
        )
    frames, multiplier = frames_in(model, trajectory), 0.0 if steady is None else steady.floquet_multiplier
    return ForwardRun(trajectory, joint_angles, joint_rates, *frames, angles, multiplier)


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
        return self.model.motor_efforts(found.efforts)


def limited_values(model: Model, names: Collection[str], curves: Curves, run: ForwardRun) -> dict[str, Array]:
    """The quantities of some kinds of limits, by name, shape [T, M] each.

    Args:
        names: Which, of `kinds_of_limits`.
        curves: Of the motors, as simulated.
    """
    performed = PerformedCurves(model, curves, run)
    return {name: kinds_of_limits()[name].values(performed) for name in names}
