"""Animations and limits in other units: degrees taken for radians, millimetres for metres, milliseconds for seconds."""

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Character, Joint, Motor, Track
from calmotion.usd.reading.motors.driven_motors import BODIES, SKELETON

_RADIANS = ((np.pi / 180.0, "degrees taken for radians"),)
_METRES = ((1e-2, "centimetres taken for metres"), (1e-3, "millimetres taken for metres"))
_POSED = (BODIES, SKELETON)  # sources of motors that have rotations in place of angles
_FASTEST = 100.0  # mean speed of a joint without a limit of its speed [rad/s or m/s]: 955 turns a minute
_OVER_LIMIT = 10.0  # mean speed of a joint, of its limit, at which the animation cannot be meant
_SLOWEST = 0.01  # peak speed of the fastest motor of a robot that moves [rad/s or m/s]
_GENTLE = 0.2  # peak speed of angles that may be radians taken for degrees [rad/s]
_LEAST_ANGLE = 0.5  # largest of such angles that is told [deg]
_SPARSE = 0.5  # time between samples of an animation [s]
_MANY_TURNS = 30.0  # a limit of an angle beyond which it was rather written in degrees [rad]
_TURN = 2.0 * np.pi + 0.01  # a limit within which it may have been written in radians [deg]
_FEW = 3  # limited hinges, all of which are within that
_ROUND = 5.0  # what limits are multiples of [deg]
SECONDS = ((1e-3, "milliseconds", "ms"), (1e-6, "microseconds", "us"), (1e-9, "nanoseconds", "ns"))


def motion_doubts(character: Character, tracks: Sequence[Track]) -> tuple[str, ...]:
    """Sentences about animations that are far beyond limits, or almost stand still and would not in other units.

    Args:
        tracks: One for each motor [rad or m].
    """
    led = [(m, t) for m, t in zip(character.motors, tracks, strict=True) if m.follows is None and len(t.times) > 1]
    found: dict[str, list[str]] = {}
    for motor, track in led:
        joint = character.joints[motor.joint]
        if text := _far_beyond(motor, joint, track):
            found.setdefault(_cause(motor, joint, track), []).append(text)
    notes = []
    for cause, texts in found.items():
        more = f" (and {len(texts) - 1} more)" if len(texts) > 1 else ""
        notes.append(f"{texts[0]}{more}{cause}")
    still = _almost_still(led)
    return (*notes, *still, *(_in_radians(character, led) if not still else ()))


def limit_doubts(character: Character) -> tuple[str, ...]:
    """Sentences about limits of angles that were written in the other unit."""
    hinges = [joint for joint in character.joints if joint.kind == "revolute" and joint.lower < joint.upper]
    limits = [(j, np.array([v for v in (j.lower, j.upper) if np.isfinite(v) and v != 0.0])) for j in hinges]
    limited = [(joint, values) for joint, values in limits if len(values)]
    wide = [joint for joint, v in limited if np.abs(v).max() > _MANY_TURNS and _is_round(v)]
    if wide:
        return (_limits_text(wide, np.pi / 180.0, "degrees taken for radians"),)
    narrow = [(joint, v) for joint, v in limited if np.degrees(np.abs(v)).max() <= _TURN]
    sure = [
        joint for joint, v in narrow if _is_round(180.0 / np.pi * np.degrees(v)) and not _is_round(2.0 * np.degrees(v))
    ]
    if len(narrow) == len(limited) and (sure or len(narrow) >= _FEW):
        return (_limits_text([joint for joint, _ in narrow], 180.0 / np.pi, "radians taken for degrees"),)
    return ()


def _is_round(values: Array) -> bool:
    """Whether values are multiples of 5, but for the digits that are left out."""
    away = np.abs(values - _ROUND * np.round(values / _ROUND))
    return bool(np.all(away <= 1e-3 * np.abs(values)) and np.all(np.abs(values) >= _ROUND - 0.1))


def _limits_text(joints: Sequence[Joint], factor: float, name: str) -> str:
    low, high = np.degrees([joints[0].lower, joints[0].upper])
    more = f" (and {len(joints) - 1} more)" if len(joints) > 1 else ""
    return (
        f"{joints[0].path}: its limits are {low:.4g} and {high:.4g} deg{more}; {name}? Limits times {factor:.4g} would "
        f"be {low * factor:.4g} and {high * factor:.4g} deg"
    )


def _remedy(name: str) -> str:
    return "Scale the samples by this factor" + (
        ", or read the table with --set motion.read.angles=deg" if "degrees" in name else ""
    )


def _speed(track: Track) -> float:
    """The mean speed of an animation."""
    return float(np.abs(np.diff(track.values)).sum() / (track.times[-1] - track.times[0]))


def _is_fast(motor: Motor, speed: float) -> bool:
    limit = motor.max_velocity
    return speed > (_OVER_LIMIT * limit if np.isfinite(limit) else _FASTEST)


def _far_beyond(motor: Motor, joint: Joint, track: Track) -> str:
    """By what an animation is far beyond the limits; empty where it is not."""
    low, high = float(track.values.min()), float(track.values.max())
    span, speed = joint.upper - joint.lower, _speed(track)
    beyond = max(joint.lower - low, high - joint.upper)
    shown, unit = (1.0, "m") if motor.linear else (180.0 / np.pi, "deg")
    # more than half a turn, and than half the range
    if np.isfinite(span) and beyond > (5.0 * span if motor.linear else max(0.5 * span, np.pi)):
        value, bound = (high, joint.upper) if high - joint.upper == beyond else (low, joint.lower)
        return (
            f"{motor.path}: its animation goes to {value * shown:.4g} {unit}, its limit is {bound * shown:.4g} {unit}"
        )
    if _is_fast(motor, speed):
        kept = motor.max_velocity if np.isfinite(motor.max_velocity) else _FASTEST
        return (
            f"{motor.path}: its animation has a mean speed of {speed * shown:.4g} {unit}/s, where at most "
            f"{kept * shown:.4g} {unit}/s can be"
        )
    return ""


def _cause(motor: Motor, joint: Joint, track: Track) -> str:
    """The rest of the sentence: the unit in which an animation far beyond its limits would fit, and what to do."""
    if motor.source in _POSED and not motor.linear:
        return "; poses have no unit of angles; correct timeCodesPerSecond of the stage, the poses, or the limit"
    low, high, speed = float(track.values.min()), float(track.values.max()), _speed(track)
    for factor, name in _METRES if motor.linear else _RADIANS:
        fits = joint.lower <= factor * low + 1e-3 and factor * high <= joint.upper + 1e-3
        if fits and not (_is_fast(motor, speed) and factor * speed > min(motor.max_velocity, _FASTEST)):
            return f"; {factor:.4g} times that would be within ({name}?). {_remedy(name)}"
    return ": in no usual unit would that be within; is it a track of another joint?"


def _in_radians(character: Character, led: Sequence[tuple[Motor, Track]]) -> list[str]:
    """About angles that all are within half a turn in radians, slow, and within their limits times 57.3."""
    hinges = [(character.joints[motor.joint], motor, track) for motor, track in led if not motor.linear]
    moved = [(j, m, t) for j, m, t in hinges if np.ptp(t.values) > 0.0]
    factor = 180.0 / np.pi
    if not moved or len(hinges) < len(led) or any(m.source in _POSED for _, m, _ in moved):
        return []
    speeds = [float(np.abs(np.diff(t.values) / np.diff(t.times)).max()) for _, _, t in moved]
    largest = max(float(np.abs(t.values).max()) for _, _, t in hinges)
    fit = all(
        j.lower <= factor * float(t.values.min()) + 1e-3 and factor * float(t.values.max()) <= j.upper + 1e-3
        for j, _, t in hinges
    ) and all(factor * speed <= m.max_velocity for speed, (_, m, _) in zip(speeds, moved, strict=True))
    if not fit or not _LEAST_ANGLE <= factor * largest <= np.pi + 1e-3 or max(speeds) > _GENTLE:
        return []
    return [
        f"{moved[int(np.argmax(speeds))][1].path}: all angles of the animation are within {factor * largest:.3g} deg, "
        f"at {factor * max(speeds):.3g} deg/s at most; radians taken for degrees? Samples times {factor:.4g} would be "
        "within their limits"
    ]


def _almost_still(led: Sequence[tuple[Motor, Track]]) -> list[str]:
    speeds = [float(np.abs(np.diff(t.values) / np.diff(t.times)).max()) for _, t in led]
    if not speeds or not 0.0 < max(speeds) < _SLOWEST:
        return []
    motor, track = led[int(np.argmax(speeds))]
    step, peak = float(np.median(np.diff(track.times))), max(speeds)
    if step < _SPARSE:
        return []
    factor, name, setting = next((unit for unit in SECONDS if unit[0] * step <= _SPARSE), SECONDS[-1])
    shown, unit = (1.0, "m/s") if motor.linear else (180.0 / np.pi, "deg/s")
    return [
        f"{motor.path}: the fastest motor moves by {peak * shown:.3g} {unit}, and its samples are {step:.4g} s apart; "
        f"{name} taken for seconds? Scale the times by {factor:g}, or read the table with --set "
        f"motion.read.times={setting}"
    ]
