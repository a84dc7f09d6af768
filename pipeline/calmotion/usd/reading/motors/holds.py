"""Held and stepped keys in sampled tracks.

A C2 cubic through samples swings by a tenth of a step before and after it. Where it would, samples are added between
two holds, so that the cubic through all of them stands still in the holds and does not pass their values. It stays C2,
and the search and the writer treat it as any other track.
"""

import numpy as np
from scipy.interpolate import CubicSpline

from calmotion.arrays import Array
from calmotion.model import Track
from calmotion.model.curves import interpolate
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints.joint_prims import JointPrim

_SAME = 1e-6  # of the range of a track: values that are nearer are equal
_KEYS = 2.0  # frames: equal samples that are farther apart are keys, and two of them a hold
_SWING = 0.05  # of the way to a hold: a smaller swing of the cubic in it is left
_SHARE = 0.7  # of the way from hold to hold between two samples: that is a step
_SMALL = 1e-3  # of the range of a track: smaller ways are rounding of its samples
_PARTS = 8  # of an interval, at which the swing is looked for
_STEP = 3.0  # frames: a motion from hold to hold that takes no longer is a step
_FREE = 2  # intervals of a motion at the end of a track, which rests there; longer ones go on as the cubic does
_RISEN = np.array([7.0, 1.0]) / 8.0  # shares of two samples in the middle of a cubic that leaves the first at rest

Samples = tuple[Array, Array]  # times [s] and values [rad or m]


def held(track: Track, frame: float, joint: JointPrim, reading: Reading) -> Track:
    """A track with the samples that its holds and steps need; itself where the cubic through its own stands still in
    its holds, or where corners are authored.

    Args:
        track: [rad] or [m].
        frame: Time between frames [s].
        joint: The joint that it moves.
        reading: Receives a note of the steps.
    """
    if len(track.times) < 3 or len(track.corners) or np.ptp(track.values) == 0.0:
        return track
    last, holds = len(track.times) - 1, _sharp(track, _holds(track, frame))
    if not holds:
        return track
    parts, steps = [(track.times, track.values)], []
    starts, ends = [0, *(end for _, end in holds)], [*(start for start, _ in holds), last]
    for k, (start, end) in enumerate(zip(starts, ends, strict=True)):
        if start < end:
            times, values = track.times[start : end + 1], track.values[start : end + 1]
            parts.append(_between(times, values, k > 0, k < len(holds)))
            if times[-1] - times[0] <= _STEP * frame * (1.0 + _SAME):
                steps.append((times, values))
    if steps:
        reading.note(_note(steps, joint))
    times, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(times)
    times, values = times[order], values[order]
    # The cubic has one piece over the two intervals at each end of a track: where it rests there, they share its first.
    if holds[0][0] <= _FREE:
        times, values = np.insert(times, 1, times[:2].mean()), np.insert(values, 1, values[:2] @ _RISEN)
    if last - holds[-1][1] <= _FREE:
        times, values = np.insert(times, -1, times[-2:].mean()), np.insert(values, -1, values[-2:] @ _RISEN[::-1])
    return Track(times, values)


def _holds(track: Track, frame: float) -> list[tuple[int, int]]:
    """First and last sample of each run of equal samples that is no coincidence: of three samples, of two that are
    keys, or of two beside a jump to another run."""
    flat = np.abs(np.diff(track.values)) <= _SAME * np.ptp(track.values)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flat, [False]]).astype(np.int8)))
    runs = [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]
    jumps = {
        k for (_, end), (start, _) in zip(runs[:-1], runs[1:], strict=True) if start == end + 1 for k in (end, start)
    }
    return [
        (start, end)
        for start, end in runs
        if end - start > 1 or track.times[end] - track.times[start] > _KEYS * frame or jumps & {start, end}
    ]


def _sharp(track: Track, holds: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Of holds those that a step leads to or from, or in which the cubic through the samples swings."""
    values, last, span = track.values, len(track.times) - 1, float(np.ptp(track.values))
    spline = interpolate(track, float(track.times[-1]))
    starts, ends = [0, *(end for _, end in holds)], [*(start for start, _ in holds), last]
    steps = [_is_step(values[start : end + 1], span) for start, end in zip(starts, ends, strict=True)]
    found = []
    for k, (first, end) in enumerate(holds):
        way = max(_way(values[first::-1]), _way(values[end:]))
        parts = np.arange(_PARTS * (end - first) + 1) / _PARTS
        times = np.interp(parts, np.arange(end - first + 1), track.times[first : end + 1])
        swings = way > _SMALL * span and np.abs(spline(times) - values[first]).max() > _SWING * way
        if steps[k] or steps[k + 1] or swings:
            found.append((first, end))
    return found


def _is_step(values: Array, span: float) -> bool:
    """Whether most of the way from the first to the last value is made between two neighbours, and none back."""
    ways = np.diff(values) * np.sign(values[-1] - values[0])
    return len(ways) > 0 and ways.sum() > _SMALL * span and ways.min() >= 0.0 and ways.max() > _SHARE * ways.sum()


def _way(values: Array) -> float:
    """How far values go from the first before they turn back or rest."""
    way = 0.0
    for step in np.diff(values):
        if step * way < 0.0 or step == 0.0:
            break
        way += float(step)
    return abs(way)


def _between(times: Array, values: Array, after_hold: bool, before_hold: bool) -> Samples:
    """More samples of a motion, such that the cubic through all leaves and reaches holds at rest.

    One sample is added beside each hold. Where the cubic would begin backwards, it rests at the next sample as well.

    Args:
        times, values: From the end of a hold, or of the track, to the next, shape [n].
        after_hold, before_hold: Whether it is a hold.
    """
    count = len(times) - 1
    if count == 1:
        return _step(times, values)
    if count <= _FREE:
        after_hold = before_hold = True
    sides = [(0, 1)] * after_hold + [(count, count - 1)] * before_hold  # of the hold, and next to it
    added = np.array([0.5 * (times[end] + times[inner]) for end, inner in sides])
    order = np.argsort(np.concatenate([times, added]))
    conditions = tuple((2, 0.0) if rest else "not-a-knot" for rest in (after_hold, before_hold))

    def slopes(own: Array, more: Array) -> Array:
        whole = CubicSpline(
            np.concatenate([times, added])[order], np.concatenate([own, more])[order], bc_type=conditions
        )
        return np.asarray(whole(times[[end for end, _ in sides]], 1))

    effects = np.stack([slopes(np.zeros_like(values), one) for one in np.eye(len(sides))], axis=1)
    found = np.linalg.solve(effects, -slopes(values, np.zeros(len(sides))))
    for (end, inner), value in zip(sides, found, strict=True):
        if (value - values[end]) * (values[inner] - values[end]) < 0.0:
            near, rest = (slice(0, 2), slice(1, None)) if end == 0 else (slice(-2, None), slice(None, -1))
            first, others = (
                _step(times[near], values[near]),
                _between(times[rest], values[rest], after_hold or end == 0, before_hold or end > 0),
            )
            return np.concatenate([first[0], others[0]]), np.concatenate([first[1], others[1]])
    return added, np.asarray(found, np.float64)


def _step(times: Array, values: Array) -> Samples:
    """The samples at a quarter and three quarters between two, through which the cubic goes from rest to rest.

    Its acceleration rises, falls and rises linearly: it reaches 8 times the way over the time squared, its speed twice
    the way over the time.
    """
    parts, ways = np.array([0.25, 0.75]), np.array([1.0, 11.0]) / 12.0
    return times[0] + parts * (times[1] - times[0]), values[0] + ways * (values[1] - values[0])


def _note(steps: list[Samples], joint: JointPrim) -> str:
    """What steps are there, and what they excite."""
    times, values = max(steps, key=lambda samples: float(np.ptp(samples[1])))
    way, brief = float(np.ptp(values)), float(times[-1] - times[0])
    shown = f"{1e3 * way:.4g} mm" if joint.kind == "prismatic" else f"{np.degrees(way):.4g} deg"
    most = f"{len(steps)} times, most by {shown}" if len(steps) > 1 else f"by {shown}"
    return (
        f"{joint.path}: its samples are held and step {most} between {times[0]:.4g} and {times[-1]:.4g} s; it goes "
        f"from hold to hold without overshoot, and excites all frequencies up to about {1.0 / brief:.3g} Hz: smooth "
        "the keys unless a step is intended"
    )
