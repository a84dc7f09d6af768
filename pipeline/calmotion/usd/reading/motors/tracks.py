"""The samples of a drive as a track in seconds, and radians or metres."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.model.curves import interpolate
from calmotion.usd.clock import Clock
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.motors.splines import read_spline, value_at

if TYPE_CHECKING:
    from pxr import Sdf, Usd

MOST = 1_000_000  # samples of one motor
_SPARSE = 2.0  # frames: samples further apart are keys rather than a sampled curve
_SWING = 0.1  # of the range of a track: a smaller swing beyond two neighbouring samples is not noted
_LOOKED_AT = 33  # points between two samples
_CLOSE = 1e-4  # samples closer than this share of a frame count as simultaneous


def sample_codes(attribute: Usd.Attribute) -> Array:
    """Time codes of the samples of an attribute; the knots of its spline where it has no samples."""
    codes = attribute.GetTimeSamples()
    if not codes and attribute.HasSpline():
        codes = list(attribute.GetSpline().GetKnots().keys())
    return np.array(codes, dtype=np.float64)


def read_track(attribute: Usd.Attribute, clock: Clock, reading: Reading, to_si: float) -> Track:
    """The track of a motor.

    Samples are taken where they are, also outside the shot. Where they begin after the first frame or end
    before the last, USD holds the value, so frames with that value are added. For splines see `read_spline`. A
    constant gives two equal samples.

    Args:
        attribute: The drive's target position, degrees or stage length.
        clock: The clock of the shot.
        reading: Receives notes and warnings for the user.
        to_si: Radians, or metres, in its unit.

    Raises:
        ShotError: A sample that is blocked, not a number or not finite, or too many of them.
    """
    path, notes = attribute.GetPath(), reading.notes
    frames = clock.time_codes(clock.frame_times())
    _refuse_too_many(attribute)
    codes = np.array(attribute.GetTimeSamples(), dtype=np.float64)
    if len(codes) == 0 and attribute.HasSpline():
        return read_spline(attribute, clock, reading, to_si)
    if len(codes) == 0:
        codes = frames[[0, -1]]
    codes = _without_near_duplicates(codes, clock, path, notes)
    values = np.array([value_at(attribute, code) for code in codes])
    held = (frames < codes[0] - 1e-9, frames > codes[-1] + 1e-9)
    if len(attribute.GetTimeSamples()) > 0 and (held[0].any() or held[1].any()):
        notes.append(f"{path}: its samples do not span the shot; the first and last value are held, as USD does")
    codes = np.concatenate([frames[held[0]], codes, frames[held[1]]])
    values = np.concatenate([np.full(held[0].sum(), values[0]), values, np.full(held[1].sum(), values[-1])])
    track = Track(clock.seconds(codes), to_si * values)
    notes.extend(_swings(path, track, codes, to_si, frames))
    return track


def _swings(path: Sdf.Path, track: Track, codes: Array, to_si: float, frames: Array) -> list[str]:
    """A note where the smooth curve swings far beyond two samples between which frames have none."""
    span = np.ptp(track.values)
    if len(frames) < 2 or span == 0.0:
        return []
    wide = np.nonzero(np.diff(codes) > _SPARSE * (frames[1] - frames[0]))[0]
    curve = interpolate(track, float(track.times[-1]))
    worst = (0.0, 0, 0.0)
    for k in wide:
        low, high = np.sort(track.values[k : k + 2])
        between = curve(np.linspace(track.times[k], track.times[k + 1], _LOOKED_AT))
        for extreme, by in ((between.max(), between.max() - high), (between.min(), low - between.min())):
            worst = max(worst, (float(by), int(k), float(extreme)))
    by, at, extreme = worst
    if by <= _SWING * span:
        return []
    first, second, reached = (f"{value / to_si:.4g}" for value in (*track.values[at : at + 2], extreme))
    return [
        f"{path}: between its samples at time codes {codes[at]:.6g} and {codes[at + 1]:.6g} ({first} and {second}) the "
        f"smooth curve through all samples reaches {reached}; author a sample at every frame, or a spline, if that is "
        "not meant"
    ]


def _refuse_too_many(attribute: Usd.Attribute) -> None:
    count = attribute.GetNumTimeSamples()
    if count > MOST:
        raise ShotError(
            f"has too many samples (at most {MOST} are supported)",
            path=attribute.GetPrimPath(),
            attribute=attribute.GetName(),
            found=count,
            remedy="Sample it at the rate of the frames, or of the motor controller",
        )


def _without_near_duplicates(codes: Array, clock: Clock, path: Sdf.Path, notes: list[str]) -> Array:
    """Of time codes closer than `_CLOSE`, the last: no smooth curve passes through two values there."""
    least = _CLOSE * clock.time_codes_per_second / clock.frames_per_second
    follows = np.append(np.diff(codes) < least, False)
    if follows.any():
        notes.append(
            f"{path}: of samples at nearly the same time only the last is used ({int(follows.sum())} ignored, the "
            f"first at time code {codes[follows][0]:.9g})"
        )
    kept: Array = codes[~follows]
    return kept
