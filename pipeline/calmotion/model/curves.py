"""Motor tracks as smooth curves, C2 cubic interpolants through their samples; curves of a result, and at a tempo."""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from scipy.interpolate import CubicSpline, PPoly
from scipy.spatial.transform import Rotation, RotationSpline

from calmotion.arrays import Array
from calmotion.model.animation import Animation, Contact, MovingFrame, Schedule, Track
from calmotion.model.character import Character
from calmotion.model.result import MotorCurve, Result
from calmotion.model.tempo import TimeMap

_Schedule = TypeVar("_Schedule", Contact | None, Schedule | None)

Sample = Callable[[Array, int], Array]  # times [s], order of the derivative -> values of shape [n, ...]
TURN = 2.0 * np.pi


SAME = 1e-9  # times that are closer are one [s]
CLOSED = 1e-4  # largest gap between the ends of a cyclic shot [rad or m]
MOST_PARTS = 16  # samples of a track in a frame
NEAR = 1e-4  # [rad or m], by which a cubic through samples may be off between them


def interpolate(track: Track, end: float) -> PPoly:
    """The cubic interpolant through a track's samples, C2 but for its corners; constant outside them, as USD holds the
    value.

    The end conditions are not-a-knot where the samples cover the shot, so that a spline sampled at the frames is
    read back exactly; where the value is held before or after, the slope there is zero.

    Args:
        end: Last frame of the shot [s].
    """
    times, values = np.asarray(track.times, float), np.asarray(track.values, float)
    if len(times) == 1:
        times, values = np.array([times[0], times[0] + 1.0]), np.repeat(values, 2)
    held_before, held_after = times[0] > 1e-9, times[-1] < end - 1e-9
    if len(track.corners):
        return _pieces(times, values, track.corners, held_before, held_after)
    left = (1, 0.0) if held_before else "not-a-knot"
    right = (1, 0.0) if held_after else "not-a-knot"
    if len(times) < 4 and not (held_before or held_after):
        return CubicSpline(times, values, bc_type="not-a-knot")
    if len(times) == 2 and (held_before != held_after):
        # a line takes two end conditions: both ends at rest
        left = right = (1, 0.0)
    return CubicSpline(times, values, bc_type=(left, right))


def _pieces(times: Array, values: Array, corners: Array, held_before: bool, held_after: bool) -> PPoly:
    """Cubic interpolants between corners, put together."""
    at = np.searchsorted(times, np.concatenate([[-np.inf], np.sort(corners), [np.inf]]) - SAME)
    at = np.unique(np.clip(at, 0, len(times) - 1))
    parts = []
    for first, last in zip(at[:-1], at[1:], strict=True):
        inside = slice(first, last + 1)
        # what is held before or after begins and ends at rest
        left = (1, 0.0) if first == 0 and held_before else "not-a-knot"
        right = (1, 0.0) if last == len(times) - 1 and held_after else "not-a-knot"
        parts.append(CubicSpline(times[inside], values[inside], bc_type=(left, right)))
    return PPoly(np.concatenate([part.c for part in parts], axis=1), times[at[0] : at[-1] + 1])


def held_curve(track: Track, end: float) -> Sample:
    """A track over a shot that plays once."""
    spline = interpolate(track, end)
    first, last = spline.x[0], spline.x[-1]

    def sample(times: Array, order: int) -> Array:
        values = np.asarray(spline(np.clip(times, first, last), order))
        return values if order == 0 else np.where((times < first) | (times > last), 0.0, values)

    return sample


def cyclic_curve(track: Track, end: float) -> Sample:
    """A track over all times of a cyclic shot: the periodic C2 cubic interpolant through its samples.

    Whole turns per cycle accumulate. Any other difference of the ends is removed: see `cycle_gap`.
    """
    once = held_curve(track, end)
    inner = (track.times > 1e-9) & (track.times < end - 1e-9)
    times = np.concatenate([[0.0], np.asarray(track.times, float)[inner], [end]])
    ends = once(times[[0, -1]], 0)
    gain = TURN * np.round((ends[1] - ends[0]) / TURN)
    values = np.concatenate([ends[:1], np.asarray(track.values, float)[inner], ends[1:]]) - gain * times / end
    values[-1] = values[0]
    corners = track.corners[(track.corners >= 0.0) & (track.corners <= end)]
    if len(corners):
        # cycles before and after make the pieces next to the corners periodic
        around = np.array([-end, 0.0, end])[:, None]
        three = Track((times[:-1] + around).ravel(), np.tile(values[:-1], 3), (corners + around).ravel())
        spline = interpolate(three, 0.0)
    else:
        spline = CubicSpline(times, values, bc_type="periodic")

    def sample(times: Array, order: int) -> Array:
        periodic = np.asarray(spline(np.mod(times, end), order))
        return periodic + (gain * times / end if order == 0 else gain / end if order == 1 else 0.0)

    return sample


def curve_of(track: Track, end: float, cyclic: bool) -> Sample:
    """A track over a shot that plays once, or a cyclic shot."""
    return (cyclic_curve if cyclic else held_curve)(track, end)


def cycle_gap(track: Track, end: float, turning: bool) -> float:
    """Gap between the ends of a track in a cyclic shot [rad or m].

    Args:
        end: Last frame, which is the first of the next cycle [s].
        turning: Whether whole turns do not count.
    """
    first, last = held_curve(track, end)(np.array([0.0, end]), 0)
    apart = last - first
    return float(abs(apart - TURN * np.round(apart / TURN)) if turning else abs(apart))


def rotation_spline(frame: MovingFrame) -> RotationSpline:
    """The rotations of a root that moves, between its samples."""
    times, rotations = frame.times, Rotation.from_quat(frame.rotations, scalar_first=True)
    if len(times) == 1:
        times, rotations = np.array([times[0], times[0] + 1.0]), Rotation.concatenate([rotations, rotations])
    return RotationSpline(times, rotations)


def root_at(frame: MovingFrame, time: float | Array) -> Rotation:
    """How a root is turned at a time [s], or at several."""
    return rotation_spline(frame)(np.clip(time, frame.times[0], frame.times[-1]))


def optimized_curve(animation: Animation, curve: MotorCurve, cyclic: bool) -> Sample:
    """The curve of a motor in a result: the animator's curve, with its corners, plus the smooth offset."""
    end = float(animation.frame_times[-1])
    base = curve_of(animation.tracks[curve.motor], end, cyclic)
    if not curve.changed:
        return base
    # frames hold the offset exactly, as its knots lie on them
    offset = curve_of(Track(animation.frame_times, curve.frame_values - base(animation.frame_times, 0)), end, cyclic)
    return lambda times, order: base(times, order) + offset(times, order)


def commanded_curves(
    character: Character, animation: Animation, result: Result | None
) -> Callable[[Array, int], Array]:
    """The curves of all motors: the optimised ones of a result, else what the shot carries.

    Returns:
        A function of times within the shot [s], shape [n], and the order of the derivative; it gives the values
        [rad or m], shape [n, M], or their derivatives.
    """
    end, cyclic = float(animation.frame_times[-1]), character.retarget.cyclic
    if result is not None and result.curves:
        curves = [optimized_curve(animation, curve, cyclic) for curve in result.curves]
    else:
        curves = [curve_of(track, end, cyclic) for track in animation.current]

    def sample(times: Array, order: int) -> Array:
        columns = [curve(np.asarray(times, np.float64), order) for curve in curves]
        return np.stack(columns, axis=1) if columns else np.zeros((len(times), 0))

    return sample


def retimed(animation: Animation, tempo: TimeMap, frame_times: Array) -> Animation:
    """An animation at a tempo. Tracks have samples at the performance's frames, and between them where it takes more to
    be as the animation was.

    Args:
        animation: As it was made.
        tempo: Its times and the performance's.
        frame_times: Of the performance [s], shape [f], first 0.
    """
    end = float(animation.frame_times[-1])

    def curve(track: Track, parts: int = 1) -> Track:
        times = _divided(frame_times, parts)
        corners = tempo.performed(track.corners)
        corners = corners[(corners > 0.0) & (corners < frame_times[-1])]
        times, whole = _with_corners(times, corners), held_curve(track, end)
        found = Track(times, whole(tempo.animated(times), 0), corners)
        between = _divided(frame_times, 2 * parts)
        off = held_curve(found, float(frame_times[-1]))(between, 0) - whole(tempo.animated(between), 0)
        return curve(track, 2 * parts) if np.max(np.abs(off)) > NEAR and parts < MOST_PARTS else found

    def frame(moving: MovingFrame) -> MovingFrame:
        axes = [curve(Track(moving.times, column)) for column in moving.positions.T]
        times = max((axis.times for axis in axes), key=len)
        there = tempo.animated(times)
        position = [held_curve(Track(moving.times, column), end)(there, 0) for column in moving.positions.T]
        return MovingFrame(moving.joint, times, np.stack(position, axis=1), _continuous(root_at(moving, there)))

    tracks = tuple(curve(track) for track in animation.tracks)
    current = tracks if animation.current is animation.tracks else tuple(curve(track) for track in animation.current)
    return Animation(
        frame_times, tracks, current, tuple(frame(moving) for moving in animation.moving),
        tuple(replace(weight, times=tempo.performed(weight.times)) for weight in animation.weights),
        tuple(replace(free, times=tempo.performed(free.times)) for free in animation.free), tempo,
    )  # fmt: skip


def with_schedules_at(character: Character, tempo: TimeMap) -> Character:
    """The character whose feet come and go, and whose motors are switched, at a tempo."""

    def at(schedule: _Schedule) -> _Schedule:
        return None if schedule is None else replace(schedule, times=tempo.performed(schedule.times))

    joints = tuple(replace(joint, contact=at(joint.contact)) for joint in character.joints)
    motors = tuple(replace(motor, powered=at(motor.powered)) for motor in character.motors)
    return replace(character, joints=joints, motors=motors)


def _divided(frames: Array, parts: int) -> Array:
    """Times of frames, and of others between them: so many in each."""
    return np.asarray(np.linspace(frames[0], frames[-1], (len(frames) - 1) * parts + 1))


def _with_corners(times: Array, corners: Array) -> Array:
    """The times and those of corners, in place of any within a quarter of a sample of them."""
    if not len(corners):
        return times
    inner = times[1:-1]
    near = np.min(np.abs(inner[:, None] - corners), axis=1) < 0.25 * (times[1] - times[0])
    return np.asarray(np.union1d(np.concatenate([times[:1], inner[~near], times[-1:]]), corners))


def _continuous(rotations: Rotation) -> Array:
    """Quaternions (w, x, y, z) of which neighbours have the same sign, shape [k, 4]."""
    found: Array = rotations.as_quat(scalar_first=True)
    turns = np.where(np.sum(found[1:] * found[:-1], axis=1) < 0.0, -1.0, 1.0)
    found[1:] *= np.cumprod(turns)[:, None]
    return found
