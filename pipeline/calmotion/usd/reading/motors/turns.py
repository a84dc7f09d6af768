"""Tracks of joints that turn on, written between -180 and 180 degrees, so that they jump by a turn."""

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.model.curves import TURN
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.joints.joint_prims import JointPrim

_FASTEST = 20.0  # of a joint that turns by a whole turn between two samples: 190 turns a minute [rad/s]
_NEAR = 0.25 * TURN  # how far a jump less its turns may be from what its neighbours lead to [rad]
_MOST = 2.5  # turns of one jump; more are no wrap
_WITHIN = 1e-6  # rounding of limits [rad]


def unwrapped(track: Track, joint: JointPrim, reading: Reading) -> Track:
    """A track of an angle without its jumps by whole turns, and a note of them.

    A jump between two samples is one if it is faster than any joint, and less its turns goes on as its neighbours do:
    a spin that is keyed as 0 and 360 degrees a second apart stays a spin. A joint whose limits do not let it turn on
    keeps its jumps, with a warning.

    Args:
        track: [rad].
        joint: The joint that it moves.
        reading: Receives the note or the warning.
    """
    if len(track.times) < 2 or joint.kind != "revolute":
        return track
    steps = np.diff(track.values)
    turns = np.round(steps / TURN)
    jumps = _jumps(steps, np.diff(track.times), turns)
    if not jumps.any():
        _note_fast_turns(track, steps, joint, reading)
        return track
    first = int(np.flatnonzero(jumps)[0])
    was, then = np.degrees(track.values[first : first + 2])
    place = f"{was:.4g} to {then:.4g} deg between {track.times[first]:.4g} and {track.times[first + 1]:.4g} s"
    if np.abs(turns[jumps]).max() > _MOST:
        reading.note(
            f"{joint.path}: its animation jumps by many turns ({int(jumps.sum())} times, first from {place}); degrees "
            "taken for radians? Scale the samples, or read the table with --set motion.read.angles=deg"
        )
        return track
    values = track.values - TURN * np.concatenate([[0.0], np.cumsum(np.where(jumps, turns, 0.0))])
    if np.all((values >= joint.lower - _WITHIN) & (values <= joint.upper + _WITHIN)):
        count = f"{int(jumps.sum())} times, first" if jumps.sum() > 1 else "once,"
        reading.note(f"{joint.path}: its animation jumps by a turn {count} from {place}: it is unwrapped and turns on")
        return Track(track.times, values, track.corners)
    lower, upper = np.degrees([joint.lower, joint.upper])
    reading.warn(
        ShotError(
            "its animation jumps by a turn, and its limits do not let it turn on",
            path=joint.path,
            attribute="physics:lowerLimit, physics:upperLimit",
            found=f"{place}; {lower:.4g} to {upper:.4g} deg",
            remedy="Remove the limits if the joint turns on; else animate the way back",
        )
    )
    return track


def _note_fast_turns(track: Track, steps: Array, joint: JointPrim, reading: Reading) -> None:
    """Note turns over several samples that are faster than any joint: keys of a spline between which it turns back."""
    fast = np.sign(steps) * (np.abs(steps) > _FASTEST * np.diff(track.times))
    ends = np.concatenate([[0], np.flatnonzero(np.diff(fast)) + 1, [len(fast)]])
    for first, last in zip(ends[:-1], ends[1:], strict=True):
        turned = float(steps[first:last].sum())
        if fast[first] and last - first > 1 and abs(abs(turned) - TURN) < _NEAR:
            was, then = np.degrees(track.values[[first, last]])
            start, length = track.times[first], track.times[last] - track.times[first]
            reading.note(
                f"{joint.path}: its animation goes by a turn within {length:.3g} s, from {was:.4g} to {then:.4g} deg "
                f"at {start:.4g} s: do its keys wrap? Key the joint beyond 180 degrees where it turns on"
            )
            return


def _jumps(steps: Array, lengths: Array, turns: Array) -> Array:
    """Which steps of a track are jumps by whole turns, bool, shape [n - 1].

    Args:
        steps, lengths: Differences of values [rad] and of times [s].
        turns: The nearest number of turns of each.
    """
    rates = np.concatenate([[np.nan], steps / lengths, [np.nan]])
    sides = np.stack([rates[:-2], rates[2:]])
    known = np.isfinite(sides)
    expected = np.where(known, sides, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1) * lengths
    rest = np.abs(steps - TURN * turns - expected)
    wraps = (turns != 0) & (rest < np.abs(steps - expected))
    # two jumps side by side hide what leads to them
    alone = ~(np.concatenate([[False], wraps[:-1]]) | np.concatenate([wraps[1:], [False]]))
    near = np.where(alone, rest < _NEAR, np.abs(steps - TURN * turns) < _NEAR) | (np.abs(turns) > _MOST)
    found: Array = wraps & near & (np.abs(steps) > _FASTEST * lengths)
    return found
