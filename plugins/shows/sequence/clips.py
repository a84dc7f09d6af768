"""The clips of a repertoire, and the motions that lead from the end of one to the start of another."""

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.host import SettingError, parse_quantity
from calmotion.model import Character, held_curve, switched_motors
from calmotion.support import read_toml
from calmotion.workflow import Shot

AT_REST = 0.02  # of the fastest motor of a clip: a slower one rests
AT_ONE_PLACE = 1e-9  # by which a root and its quaternion may change where it stands still [m]
SHORTEST = 0.5  # transition [s], unless the file says otherwise
MARGIN = 0.9  # of limits and of the clips' own speeds, that a transition uses
_NAME = re.compile(r"[A-Za-z0-9][\w-]*")
# Largest rate and acceleration of a quintic between two poses at rest, for a unit of distance and of time.
PEAK_RATE, PEAK_ACCELERATION = 15.0 / 8.0, 10.0 / math.sqrt(3.0)


@dataclass(frozen=True)
class Plan:
    """What a file of clips says.

    Attributes:
        clips: Shots by the names of the clips, in their order.
        reference: `calm:retarget:reference` of all clips and transitions, or empty: as the shots say.
        shortest: Length of the shortest transition [s].
    """

    clips: Mapping[str, str]
    reference: str
    shortest: float


def read_plan(path: str | os.PathLike[str]) -> Plan:
    """Read a file of clips.

    Raises:
        ShotError: It cannot be read, or is no list of clips.
    """
    name = os.fspath(path)

    def refuse(problem: str, attribute: str = "", found: object = None, remedy: str = "") -> ShotError:
        return ShotError(problem, path=name, attribute=attribute, found=found, remedy=remedy or _REMEDY)

    try:
        tree: dict[str, Any] = read_toml(name)
    except (OSError, ValueError) as error:
        found = getattr(error, "strerror", None)
        remedy = "Check the path of the file" if found else ""
        raise refuse("the file of clips cannot be read", found=found or error, remedy=remedy) from error
    wrong = [key for key in tree if key not in ("clips", "reference", "shortest_transition")]
    if wrong:
        raise refuse("there is no such key", wrong[0], tree[wrong[0]])
    clips = tree.get("clips")
    if not isinstance(clips, dict) or len(clips) < 2 or not all(isinstance(shot, str) for shot in clips.values()):
        raise refuse("there are no two clips", "clips", clips)
    for clip in clips:
        if not _NAME.fullmatch(clip):
            raise refuse("this is no name of files", "clips", clip, "Use letters, digits, - and _")
    reference = tree.get("reference", "static")
    if reference not in ("static", "rigid", "shot"):
        raise refuse("this is no reference", "reference", reference, "Use static, rigid, or shot")
    try:
        given = tree.get("shortest_transition", SHORTEST)
        shortest = parse_quantity(given, "s") if isinstance(given, str) else float(given)
    except (SettingError, TypeError, ValueError) as error:
        raise refuse("this is no time", "shortest_transition", tree["shortest_transition"]) from error
    if not 0.0 < shortest < 3600.0:
        raise refuse("this time is out of range", "shortest_transition", shortest)
    folder = Path(name).parent
    shots = {clip: os.path.abspath(folder / shot) for clip, shot in clips.items()}
    return Plan(shots, "" if reference == "shot" else reference, shortest)


_REMEDY = 'Write [clips] with NAME = "SHOT.usda" for each clip, and above it reference = "static" if you like'


@dataclass(frozen=True, eq=False)
class Clip:
    """A clip that was read.

    Attributes:
        name: Of its files.
        shot: Its shot.
        start, end: Its first and its last pose [rad or m], shape [M].
        rates, accelerations: The largest of each motor in it [rad/s], [rad/s^2], shape [M].
    """

    name: str
    shot: Shot
    start: Array
    end: Array
    rates: Array
    accelerations: Array


def read_clips(plan: Plan, plugins: Sequence[str] = ()) -> list[Clip]:
    """Read all clips.

    Raises:
        ShotError: A clip cannot be processed, does not begin and end at rest, repeats itself, is of another robot, or
            animates more than motors.
    """
    clips = [_clip(name, Shot(path, plugins=plugins).read()) for name, path in plan.clips.items()]
    first = clips[0].shot
    other = next((m for clip in clips for m in clip.shot.character.motors if m.source != "drive"), None)
    if other is not None:
        raise ShotError(
            "transitions are written to drives, and this motor is animated otherwise",
            path=other.path,
            found=f"animated by its {other.source}",
            remedy="Animate it by the target position of its drive",
        )
    for clip in clips[1:]:
        if clip.shot.motors != first.motors or clip.shot.character.path != first.character.path:
            raise ShotError(
                "clips of different robots cannot follow one another",
                path=clip.shot.path,
                found=f"{clip.shot.character.path} with {len(clip.shot.motors)} motors",
                remedy=f"Use shots of {first.character.path} with the motors of {first.path}",
            )
    for clip in clips:
        for path, attribute in _besides_motors(clip.shot):
            raise ShotError(
                "transitions are motions of motors, and more than motors is animated in this clip",
                path=path,
                attribute=attribute,
                found=clip.shot.path,
                remedy="Remove its samples, so that it is the same in the whole clip, or leave out the clip",
            )
    return clips


def _besides_motors(shot: Shot) -> Iterator[tuple[str, str]]:
    """What changes in a clip besides the motors, as prims and attributes: a transition would have all that as it is at
    the beginning of the clip before."""
    character, animation = shot.character, shot.animation
    for frame in animation.moving:
        if max(np.ptp(frame.positions, axis=0).max(), np.ptp(frame.rotations, axis=0).max()) > AT_ONE_PLACE:
            yield character.joints[frame.joint].path, "physics:body0"
    for joint in character.joints:
        if joint.contact is not None and joint.contact.changes:
            yield joint.path, "calm:contact:active"
    for motor in switched_motors(character):
        yield character.motors[motor].prim_path, "calm:motor:powered"
    for free in animation.free:
        yield character.motors[free.motor].prim_path, "calm:motor:optimize"
    for weight in animation.weights:
        name = "rotationWeight" if weight.rotation else "positionWeight"
        yield character.targets[weight.target].path, f"calm:target:{name}"


def _clip(name: str, shot: Shot) -> Clip:
    animation, path = shot.animation, shot.path
    end = float(animation.frame_times[-1])
    if shot.character.retarget.cyclic:
        raise ShotError(
            "a cyclic shot has no end that another clip could follow",
            path=path,
            attribute="calm:retarget:cyclic",
            found=True,
            remedy="Set it to false in a layer over the shot",
        )
    curves = [held_curve(track, end) for track in animation.tracks]
    times = np.linspace(0.0, end, 8 * len(animation.frame_times))
    values, rates, accelerations = (np.stack([curve(times, k) for curve in curves], axis=1) for k in range(3))
    largest = np.max(np.abs(rates), axis=0)
    for row, where in ((0, "begin"), (-1, "end")):
        motor = int(np.argmax(np.abs(rates[row])))
        if np.abs(rates[row, motor]) > AT_REST * max(float(largest.max()), 1e-9):
            raise ShotError(
                f"the clip does not {where} at rest",
                path=path,
                attribute=shot.motors[motor],
                found=f"{rates[row, motor]:.3g} rad/s (or m/s)",
                remedy="Let it hold its pose for two frames there",
            )
    return Clip(name, shot, values[0], values[-1], largest, np.max(np.abs(accelerations), axis=0))


def transition(one: Clip, two: Clip, pace: tuple[Array, Array], shortest: float) -> tuple[Array, Array]:
    """The motion from the end of a clip to the start of another: quintics of all motors at once, from rest to rest.

    It keeps limits of joints, since the poses at its ends do, and those of velocity and acceleration. Its length is the
    shortest one of whole frames with which no motor is faster than limits and clips allow.

    Args:
        pace: Largest rate and acceleration of each motor [rad/s], [rad/s^2], shape [M].
        shortest: [s].

    Returns:
        Times [s], shape [f], and values [rad or m], shape [f, M].
    """
    frame = float(one.shot.animation.frame_times[1])
    far = np.abs(two.start - one.end)
    with np.errstate(divide="ignore", invalid="ignore"):
        needed = [
            np.where(far > 1e-9, PEAK_RATE * far / pace[0], 0.0),
            np.sqrt(np.where(far > 1e-9, PEAK_ACCELERATION * far / pace[1], 0.0)),
        ]
    length = max(shortest, float(np.max(needed, initial=0.0)))
    if not math.isfinite(length):
        motor = int(np.argmax(np.maximum(*needed)))
        raise ShotError(
            "no transition can move this motor, which moves in no clip",
            path=one.shot.motors[motor],
            found=f"{one.end[motor]:.4g} at the end of {one.name}, {two.start[motor]:.4g} at the start of {two.name}",
            remedy="Give it calm:motor:maxVelocity and maxAcceleration",
        )
    # two frames of rest at each end
    moving = math.ceil(length / frame - 1e-9)
    times: Array = frame * np.arange(moving + 5, dtype=np.float64)
    s = np.clip((times - 2.0 * frame) / (moving * frame), 0.0, 1.0)
    rise = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    values: Array = one.end + rise[:, None] * (two.start - one.end)
    return times, values


def pace_of(clips: Sequence[Clip], character: Character) -> tuple[Array, Array]:
    """The largest rate and acceleration of each motor in a transition: those of its limits, or else of the clips."""
    found = []
    for name, limits in (
        ("rates", [motor.max_velocity for motor in character.motors]),
        ("accelerations", [motor.max_acceleration for motor in character.motors]),
    ):
        own = np.max([getattr(clip, name) for clip in clips], axis=0)
        limit = np.array(limits, float)
        found.append(MARGIN * np.where(np.isfinite(limit), np.minimum(limit, np.where(own > 0, own, limit)), own))
    rates, accelerations = (np.asarray(part, np.float64) for part in found)
    return rates, accelerations
