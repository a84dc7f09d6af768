"""A compiled shot on its time grid, and failures of its simulation in the user's words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.errors import IntegrationError, ShotError
from calmotion.multibody.analysis.deflection import largest_deflection
from calmotion.multibody.analysis.joint_gaps import first_open_joint
from calmotion.multibody.analysis.modes import system_modes
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model
from calmotion.multibody.model.topology import chain_members
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.shot import Animation, Character
from calmotion.shot.character import Array
from calmotion.shot.run import RunSettings
from calmotion.shot.tolerance import tolerance_of
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.inputs.curves import needed_pre_roll, sample_tracks
from calmotion.simulation.inputs.roots import root_tracks, sample_roots
from calmotion.simulation.inputs.supported import refuse_unsupported
from calmotion.simulation.inputs.time_grid import TimeGrid, make_grid


@dataclass(frozen=True, eq=False)
class Prepared:
    """A compiled shot on a time grid; `world` holds its moving roots, see `roots.sample_roots`."""

    shot: CompiledShot
    grid: TimeGrid
    world: Array

    @property
    def character(self) -> Character:
        """The shot's character."""
        return self.shot.character

    @property
    def bodies(self) -> tuple[ReducedBody, ...]:
        """Its bodies."""
        return self.shot.bodies

    @property
    def model(self) -> Model:
        """Its multibody system."""
        return self.shot.model


def prepare(shot: CompiledShot, options: RunSettings) -> Prepared:
    """The time grid of a shot, and its moving roots on it.

    Raises:
        ShotError: Something the shot asks for is not supported.
    """
    character, animation = shot.character, shot.animation
    refuse_unsupported(character, animation, options)
    grid = grid_of(character, animation, options)
    return Prepared(shot, grid, sample_roots(animation.moving, grid))


def grid_of(character: Character, animation: Animation, options: RunSettings) -> TimeGrid:
    """The time grid of a shot, with its pre-roll."""
    pre_roll = options.pre_roll
    if pre_roll is None:
        pre_roll = max(
            needed_pre_roll(tracks, animation.frame_times)
            for tracks in (animation.tracks, root_tracks(animation.moving))
        )
    step = options.step if options.step is not None else character.retarget.time_step
    return make_grid(animation.frame_times, step, pre_roll, character.retarget.cyclic)


def first_pose_modes(shot: CompiledShot) -> tuple[Array, Array]:
    """Natural frequencies of the whole character in its first pose, motors held [Hz], ascending, and damping ratios.

    Raises:
        ShotError: It has no static equilibrium there.
    """
    return modes_of(prepare(shot, RunSettings(pre_roll=0.0)))


def modes_of(prepared: Prepared) -> tuple[Array, Array]:
    """The same of a shot that is prepared."""
    angles, _ = sample_tracks(prepared.shot.animation.tracks, prepared.grid)
    try:
        return system_modes(prepared.model, prepared.model.joint_angles(angles[0]), prepared.world[0])
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure


def lowest_frequency(prepared: Prepared) -> float:
    """The lowest of them [Hz]; 0 where there is none."""
    return float(next(iter(modes_of(prepared)[0]), 0.0))


def failure_error(prepared: Prepared, failure: SimulationFailure) -> ShotError:
    """A failed step in the user's words: which body, which joint, when; an `IntegrationError` where another step or
    integrator may succeed."""
    tree, character, system = prepared.model.tree, prepared.character, prepared.model.system
    if failure.reason == Reason.NOT_PERIODIC:
        return IntegrationError(
            "no periodic motion of the robot was found",
            path=character.path,
            attribute="calm:retarget:cyclic",
            found=True,
            remedy="Raise calm:damping:ratio, slow the loop down where it shakes most, or set calm:retarget:cyclic to "
            "false.",
        )
    if failure.reason == Reason.OPEN:
        return _chain_error(prepared, failure.component, failure.gap)
    if not np.isfinite(failure.time_s):
        return IntegrationError(
            f"the simulation {_REASONS[failure.reason]}",
            path=character.path,
            remedy="Use a smaller --step or --integrator bdf2; check whether motors of a closed chain contradict each "
            "other.",
        )
    # the static start depends neither on the step nor on the integrator
    static = failure.reason == Reason.NO_EQUILIBRIUM
    kind = ShotError if static else IntegrationError
    when = failure.time_s + prepared.grid.times[0]
    what = f"{_REASONS[failure.reason]} at {when:.3f} s"
    bend = None if failure.state is None else largest_deflection(system, failure.state)
    if bend is not None and bend.share > _FAR:
        under = "just before" if failure.share == 1.0 else f"under {failure.share:.0%} of gravity"
        return kind(
            f"the simulation {what}: {under} this body bends by {1e3 * bend.distance:.3g} mm, "
            f"{bend.share:.0%} of its length, which its modes cannot follow much further",
            path=character.bodies[tree.body[bend.component]].path,
            remedy="Check physics:youngsModulus (in the stage's units), the loads and the speed of the motion.",
        )
    joint = character.joints[tree.joint[failure.component]]
    body = character.bodies[tree.body[failure.component]].path
    if static:
        return ShotError(
            f"the robot has no static equilibrium in the pose of its first frame: under {failure.share:.0%} of gravity "
            f"it fails, first at the joint {joint.path}",
            path=body,
            remedy=_remedy_at_rest(prepared, failure.component),
        )
    return kind(
        f"the simulation {what}, first at the joint {joint.path}",
        path=body,
        remedy="Try a smaller --step; check the masses, the material and the motion of this joint there.",
    )


def refuse_open_joints(prepared: Prepared, run: ForwardRun, options: RunSettings) -> None:
    """BDF2 keeps joints closed, unless motors contradict each other; other integrators hold them together in velocity,
    and drift where steps are coarse.

    Raises:
        ShotError: Joints come apart by a tenth of the tolerance, with the first of them and the time.
    """
    gap, allowed = run.trajectory.max_joint_gap, CLOSED * tolerance_of(prepared.character, options.tolerance)
    if gap <= allowed:
        return
    tree, system = prepared.model.tree, prepared.model.system
    workspace = Workspace.for_system(system)
    found = first_open_joint(system, run.trajectory, run.joint_angles, allowed, workspace)
    if found is None:
        raise open_joints(gap, options.scheme, prepared.grid.h, prepared.character.path)
    time = float(prepared.grid.times[found.instant])
    if options.scheme == "bdf2" and found.joint in _in_chains(prepared.model):
        raise _chain_error(prepared, found.joint, found.gap, time)
    path = prepared.character.joints[[*tree.joint, *tree.closing][found.joint]].path
    raise open_joints(gap, options.scheme, prepared.grid.h, path, time)


def _in_chains(model: Model) -> set[int]:
    """Numbers of the joints of closed chains."""
    parent, side, tree = model.system.parent, model.system.side, model.tree
    closing = range(len(tree.joint), len(tree.joint) + len(tree.closing))
    return set(closing).union(*(chain_members(parent, side[number]) for number in closing))


def open_joints(
    gap: float, integrator: str, step: float, path: str = "", time: float | None = None
) -> IntegrationError:
    """The error of a simulation whose joints come apart.

    Args:
        gap: The largest [m].
        integrator: Its name.
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


def _chain_error(prepared: Prepared, joint: int, gap: Array, time: float | None = None) -> ShotError:
    """The error of a closed chain that does not close.

    Args:
        joint: The one that stays open the most; those that close chains come after those of the tree.
        gap: [m, rad], shape [6].
        time: [s]; None: that of the static start.
    """
    tree, character, system = prepared.model.tree, prepared.character, prepared.model.system
    order = [*tree.joint, *tree.closing]
    chain = {order[joint]}
    for number, closing in enumerate(tree.closing, len(tree.joint)):
        members = chain_members(system.parent, system.side[number])
        if number == joint or int(system.side[joint, 1]) in members:
            chain |= {closing, *(tree.joint[b] for b in members)}
    motors = [motor.path for motor in character.motors if motor.joint in chain]
    far, turned = float(np.linalg.norm(gap[:3])), float(np.degrees(np.linalg.norm(gap[3:])))
    open_by = f"{1e3 * far:.3g} mm" if far > 1e-6 else f"{turned:.3g} degrees"
    named = [*motors[:_NAMED], f"{len(motors) - _NAMED} more"] if len(motors) > _NAMED else motors
    when = "in the pose of the first frame" if time is None else f"from {time:.3f} s on"
    remedy = "Check physics:localPos0, localRot0, localPos1 and localRot1 of the joints of this chain"
    if motors:
        remedy = f"Correct the angles of its motors there, or remove the drive of one of them: {', '.join(named)}"
    return ShotError(
        f"the joints of a closed chain do not meet {when}: this one stays open by {open_by}",
        path=character.joints[order[joint]].path,
        remedy=f"{remedy}.",
    )


def _remedy_at_rest(prepared: Prepared, component: int) -> str:
    """What would hold a body that finds no static equilibrium."""
    tree, character = prepared.model.tree, prepared.character
    joint, body = character.joints[tree.joint[component]], character.bodies[tree.body[component]]
    driven = any(motor.joint == tree.joint[component] for motor in character.motors)
    ways = []
    if not driven and joint.kind != "fixed":
        ways.append(f"give {joint.path} a motor (a drive), or replace it by a fixed joint where it does not move")
    if body.flexible is not None:
        ways.append("raise physics:youngsModulus of its material (in the stage's units)")
    ways.append("check physics:mass and physics:centerOfMass of what it carries, and the joints that close its chain")
    text = "; or ".join(ways)
    return f"{text[0].upper()}{text[1:]}."


CLOSED = 0.1  # of the tolerance: joints that come apart by less are closed
_NAMED = 6  # motors in a message
_FAR = 0.25  # deflection over length that explains a failure
_REASONS = {
    Reason.SINGULAR: "meets a singular system",
    Reason.DIVERGED: "diverges",
    Reason.REFINED: "can only go on with smaller steps",
    Reason.NO_EQUILIBRIUM: "has no static equilibrium",
    Reason.OPEN: "has joints that do not meet",
}
