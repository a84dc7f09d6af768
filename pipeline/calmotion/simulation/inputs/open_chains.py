"""Closed chains whose joints do not meet: motors that contradict each other, in the user's words."""

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import Character
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.multibody.analysis.joint_faults import OpenJoint, first_open_joint
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model
from calmotion.multibody.model.topology import chain_members
from calmotion.multibody.statics.equilibrium import OPEN, open_without_gravity
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.inputs.time_grid import TimeGrid

_GIVEN_WAY = 1e-3  # gap that flexible bodies of a chain close in any case [m]
CLOSED = 0.1  # of the tolerance: joints that come apart by less are closed
_NAMED = 6  # motors in a message


def refused_gap(character: Character, options: RunSettings) -> float:
    """Largest position gap of a joint with which a simulation is not refused [m]."""
    return CLOSED * tolerance_of(character, options.tolerance)


def refuse_open_joints(
    character: Character, model: Model, grid: TimeGrid, run: ForwardRun, options: RunSettings
) -> None:
    """BDF2 keeps joints closed, unless motors contradict each other; other integrators hold them together in velocity,
    and drift where steps are coarse.

    Raises:
        ShotError: Joints come apart by a tenth of the tolerance, with the first of them and the time.
    """
    gap, allowed = run.trajectory.max_joint_gap, refused_gap(character, options)
    if gap <= allowed:
        return
    found = _first_open(model, run, allowed)
    if found is None:
        raise open_joints(gap, options.scheme, grid.h, character.path)
    time = float(grid.times[found.instant])
    if options.scheme == "bdf2" and _chain_of(model, found.joint)[0]:
        raise chain_error(character, model, found.joint, found.gap, time)
    path = character.joints[_order(model)[found.joint]].path
    raise open_joints(gap, options.scheme, grid.h, path, time)


def refuse_open_chains(
    character: Character, model: Model, grid: TimeGrid, run: ForwardRun, tolerance: float | None
) -> None:
    """Refuse motors that contradict each other in a closed chain, from a simulation of the rigid robot by BDF2.

    Flexible bodies of a chain give way to gaps of its rigid one, but what the robot should do is then known only as far
    as it meets.

    Args:
        character: Its `simulated_flexible` bodies are those that give way.
        tolerance: At the targets [m]; None: that of the shot.

    Raises:
        ShotError: The joint that stays open, the motors of its chain, and the time.
    """
    tolerance = tolerance_of(character, tolerance)
    found = _first_open(model, run, CLOSED * tolerance, OPEN)
    if found is not None and _gives_way(character, model, found.joint):
        found = _first_open(model, run, max(_GIVEN_WAY, tolerance), OPEN)
    if found is not None and _chain_of(model, found.joint)[0]:
        raise chain_error(character, model, found.joint, found.gap, float(grid.times[found.instant]))


def refuse_open_failure(
    character: Character, model: Model, grid: TimeGrid, angles: Array, world: Array, failure: SimulationFailure
) -> None:
    """Refuse motors that contradict each other so much that the rigid robot cannot be simulated.

    Args:
        angles: Of its joints, shape [T, J].
        world: Moving roots, see `roots.sample_roots`.

    Raises:
        ShotError: The joint that stays open, the motors of its chain, and the time.
    """
    if failure.reason == Reason.OPEN:
        raise chain_error(character, model, failure.component, failure.gap, float(grid.times[0]))
    if failure.state is None or not np.isfinite(failure.time_s) or len(model.system.rows) == len(model.tree.body):
        return
    n = min(round(failure.time_s / grid.h), len(angles) - 1)
    workspace = Workspace.for_system(model.system)
    workspace.work.world[:] = world[n]
    gaps = open_without_gravity(model.system, failure.state, angles[n], workspace)
    if gaps is not None:
        joint = int(np.argmax(np.abs(gaps).max(axis=1)))
        if _chain_of(model, joint)[0]:
            raise chain_error(character, model, joint, gaps[joint], float(grid.times[n]))


def open_joints(
    gap: float, integrator: str, step: float, path: str = "", time: float | None = None
) -> IntegrationError:
    """The error of a simulation whose joints come apart.

    Args:
        gap: The largest [m].
        step: [s].
        path: Of the first joint that does, or of the character.
        time: At which that begins [s]; None where it is not known.
    """
    remedy, since = "Use a smaller --step, or bdf2, which keeps them closed.", ""
    if time is not None:
        since = f", first this joint at {time:.3f} s"
    if integrator == "bdf2":
        remedy = (
            "Its motors contradict each other in a closed chain, or the joints of one do not fit together: correct the "
            "curves, remove the drive of a motor of the chain, or check localPos0 and localPos1 of its joints."
        )
    return IntegrationError(
        f"its joints come apart by {1e3 * gap:.2g} mm in the simulation{since}",
        path=path,
        attribute="--integrator",
        found=f"{integrator} with steps of {1e3 * step:.3g} ms",
        remedy=remedy,
    )


def chain_error(character: Character, model: Model, joint: int, gap: Array, time: float) -> ShotError:
    """The error of a closed chain that does not close.

    Args:
        joint: The one that stays open the most; those that close chains come after those of the tree.
        gap: [m, rad], shape [6].
        time: From which on it does not [s]; negative in the pre-roll.
    """
    order = _order(model)
    chain = {order[k] for k in {joint, *_chain_of(model, joint)[0]}}
    motors = [motor.path for motor in character.motors if motor.joint in chain]
    far, turned = float(np.linalg.norm(gap[:3])), float(np.degrees(np.linalg.norm(gap[3:])))
    open_by = f"{1e3 * far:.3g} mm" if far > 1e-6 else f"{turned:.3g} degrees"
    named = [*motors[:_NAMED], f"{len(motors) - _NAMED} more"] if len(motors) > _NAMED else motors
    when = "in the pose of the first frame" if time == 0.0 else f"from {time:.3f} s on"
    if time < 0.0:
        when = f"in the pre-roll, {when}"
    remedy = "Check physics:localPos0, localRot0, localPos1 and localRot1 of the joints of this chain"
    if len(motors) == 1:
        remedy = (
            "Correct the angles of its motor there, which the chain cannot reach (they are degrees in a shot, and rad "
            f"in a table of --motion): {motors[0]}"
        )
    elif motors:
        remedy = f"Correct the angles of its motors there, or remove the drive of one of them: {', '.join(named)}"
    if time < 0.0:
        remedy += (
            "; in the pre-roll each motor eases into its curve by itself: begin the shot at rest, or use --pre-roll=0"
        )
    return ShotError(
        f"the joints of a closed chain do not meet {when}: this one stays open by {open_by}",
        path=character.joints[order[joint]].path,
        remedy=f"{remedy}.",
    )


def _order(model: Model) -> list[int]:
    """The character's number of each joint of the system."""
    return [*model.tree.joint, *model.tree.closing]


def _chain_of(model: Model, joint: int) -> tuple[set[int], set[int]]:
    """Joints and components of the closed chains that a joint is part of, by their numbers in the system; empty where
    it is part of none."""
    joints: set[int] = set()
    components: set[int] = set()
    for closing in range(len(model.tree.joint), len(model.system.rows)):
        members = chain_members(model.system.parent, model.system.side[closing])
        if joint == closing or int(model.system.side[joint, 1]) in members:
            joints |= {closing, *members}
            components |= members
    return joints, components


def _gives_way(character: Character, model: Model, joint: int) -> bool:
    """Whether a body of the chains of a joint is flexible."""
    return any(character.bodies[model.tree.body[b]].simulated_flexible for b in _chain_of(model, joint)[1])


def _first_open(model: Model, run: ForwardRun, allowed: float, turned: float = np.inf) -> OpenJoint | None:
    workspace = Workspace.for_system(model.system)
    return first_open_joint(model.system, run.trajectory, run.joint_angles, allowed, workspace, turned)
