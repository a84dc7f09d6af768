"""A compiled shot on its time grid, and failures of its simulation in the user's words."""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import Animation, Character
from calmotion.model.character import contact_joints, switched_motors
from calmotion.model.motor import SERVO, Motor
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.deflection import largest_deflection
from calmotion.multibody.analysis.modes import system_modes
from calmotion.multibody.failure import NOWHERE, Reason, SimulationFailure
from calmotion.multibody.model.model import Model, start_angles
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.inputs.contacts import sample_world
from calmotion.simulation.inputs.curves import needed_pre_roll, sample_tracks
from calmotion.simulation.inputs.open_chains import chain_error
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
    # only what comes and goes needs the model, which is compiled when it is first used
    changing = contact_joints(character) or switched_motors(character)
    world = sample_world(character, animation, shot.model, grid) if changing else sample_roots(animation.moving, grid)
    return Prepared(shot, grid, world)


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


def pose_modes(shot: CompiledShot, time: float = 0.0) -> tuple[Array, Array]:
    """Natural frequencies of the whole character in its pose at a time [s], motors held [Hz], ascending, and damping
    ratios.

    Raises:
        ShotError: It has no static equilibrium there.
    """
    return modes_of(prepare(shot, RunSettings(pre_roll=0.0)), time)


def modes_of(prepared: Prepared, time: float = 0.0) -> tuple[Array, Array]:
    """The same of a shot that is prepared."""
    angles, _ = sample_tracks(prepared.shot.animation.tracks, prepared.grid)
    if time > 0.0 and contact_joints(prepared.character):
        raise ShotError(
            "where its feet stand later follows from a simulation: natural frequencies are those of the first frame",
            path=prepared.character.path,
            found=f"{time:g} s",
            remedy="Ask for time 0.",
        )
    row = int(np.argmin(np.abs(prepared.grid.times - time)))
    # closed chains may be closed in several ways: that of the pose as authored counts
    start = start_angles(prepared.model, prepared.model.joint_angles(angles[row]))
    try:
        return system_modes(prepared.model, start, prepared.world[row])
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure


def lowest_frequency(prepared: Prepared) -> float:
    """The lowest of them [Hz]; 0 where there is none."""
    return float(next(iter(modes_of(prepared)[0]), 0.0))


def failure_error(prepared: Prepared, failure: SimulationFailure) -> ShotError:
    """A failed step in the user's words: which body, which joint, when; an `IntegrationError` where another step or
    integrator may succeed."""
    tree, character, system = prepared.model.tree, prepared.character, prepared.model.system
    closed = len(system.rows) > len(system.parent)
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
        return chain_error(character, prepared.model, failure.component, failure.gap, float(prepared.grid.times[0]))
    if not np.isfinite(failure.time_s):
        return IntegrationError(
            f"the simulation {_REASONS[failure.reason]}",
            path=character.path,
            remedy=_remedy(closed),
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
            f"{bend.share:.0%} of its length, which is beyond the range of its modes",
            path=character.bodies[tree.body[bend.component]].path,
            remedy="Check physics:youngsModulus (in the stage's units), the loads and the speed of the motion.",
        )
    if failure.component == NOWHERE:
        return IntegrationError(f"the simulation {what}", path=character.path, remedy=_remedy(closed))
    joint = character.joints[tree.joint[failure.component]]
    body = character.bodies[tree.body[failure.component]].path
    if static:
        return ShotError(
            "the robot has no static equilibrium in the pose of its first frame: "
            f"{_weight_at_failure(prepared, failure)}, first at the joint {joint.path}",
            path=body,
            remedy=_remedy_at_rest(prepared, failure.component),
        )
    return kind(
        f"the simulation {what}, first at the joint {joint.path}",
        path=body,
        remedy="Try a smaller --step; check the masses, the material and the motion of this joint there"
        + (f", and {_CLOSED}." if closed else "."),
    )


def _remedy(closed: bool) -> str:
    """What may help where no body is known to fail first."""
    return "Use a smaller --step or --integrator bdf2" + (f"; check {_CLOSED}." if closed else ".")


def _weight_at_failure(prepared: Prepared, failure: SimulationFailure) -> str:
    """The share of gravity that a robot without static equilibrium bears, as a clause."""
    if failure.share < 0.005 and _weak_motor(prepared, failure.component) is None:
        return "nothing holds it, so that it gives way under the smallest load"
    share = f"{failure.share:.0%}" if failure.share >= 0.01 else "less than 1%"
    return f"under {share} of gravity it fails"


def _weak_motor(prepared: Prepared, component: int) -> Motor | None:
    """The servo with a limited torque that holds a component; None where none does."""
    joint = prepared.model.tree.joint[component]
    servos = (m for m in prepared.character.motors if m.model == SERVO and np.isfinite(m.max_torque))
    return next((motor for motor in servos if motor.joint == joint), None)


def _remedy_at_rest(prepared: Prepared, component: int) -> str:
    """What would hold a body that finds no static equilibrium."""
    tree, character = prepared.model.tree, prepared.character
    joint, body = character.joints[tree.joint[component]], character.bodies[tree.body[component]]
    driven = {motor.joint for motor in character.motors}
    motor = _weak_motor(prepared, component)
    free = [other.path for k, other in enumerate(character.joints) if k not in driven and other.kind in _FREE]
    free.sort(key=lambda path: path != joint.path)  # another one may give way with it, or carry it
    ways = []
    if len(free) == 1:
        ways.append(f"give {free[0]} a motor (a drive), or replace it by a fixed joint where it does not move")
    elif free:
        more = f" and {len(free) - _SHOWN} more" if len(free) > _SHOWN else ""
        ways.append(f"give {', '.join(free[:_SHOWN])}{more} motors (drives), or fixed joints where they do not move")
    if motor is not None:
        unit = "N" if motor.linear else "N m"
        ways.insert(
            0, f"raise calm:motor:maxTorque of {motor.path}, whose {motor.max_torque:.3g} {unit} cannot hold it"
        )
    if body.flexible is not None:
        ways.append("raise physics:youngsModulus of its material (in the stage's units)")
    ways.append("check physics:mass and physics:centerOfMass of what it carries, and the joints that close its chain")
    text = "; or ".join(ways)
    return f"{text[0].upper()}{text[1:]}."


_FREE = ("revolute", "prismatic", "spherical")
_SHOWN = 3  # joints in a remedy
_FAR = 0.25  # deflection over length that explains a failure
_CLOSED = "whether the closed chains can reach the poses that their motors ask for"
_REASONS = {
    Reason.SINGULAR: "meets a singular system",
    Reason.DIVERGED: "diverges",
    Reason.REFINED: "can only go on with smaller steps",
    Reason.NO_EQUILIBRIUM: "has no static equilibrium",
    Reason.OPEN: "has joints that do not meet",
}
