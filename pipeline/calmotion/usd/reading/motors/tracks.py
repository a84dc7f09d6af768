"""The samples or the spline of a drive as a track in seconds, and radians or metres."""

import numpy as np
from pxr import Gf, Sdf, Ts, Usd

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.model.curves import held_curve, interpolate
from calmotion.usd.clock import Clock
from calmotion.usd.reading.context import Reading

STEP = 0.01  # duration over which a step is played, since no motor can jump [s]
_JUMP = 1e-6  # smallest step, relative to the range of the spline
_CORNER = 1e-3  # smallest change of slope at a corner, relative to the steepest slope
_EXACT = 2e-8  # largest difference between track and spline between samples [rad or m]
_ROUNDS = 8  # largest number of refinements


def read_spline(attribute: Usd.Attribute, clock: Clock, reading: Reading, to_si: float) -> Track:
    """A spline as a track that differs from it by less than a millionth of a radian or metre.

    It is sampled at its knots and at the frames, where a smooth one is read back exactly, and more densely where its
    tangents need it. Corners stay corners; a step becomes a steep line. Both raise a warning, since they excite the
    structure.

    Args:
        attribute: The drive's target position, degrees or stage length.
        reading: Receives notes and warnings for the user.
        to_si: Radians, or metres, in its unit.

    Raises:
        ShotError: It has no value, or one that is not finite, within the shot.
    """
    spline, path = attribute.GetSpline(), attribute.GetPath()
    frames = clock.time_codes(clock.frame_times())
    knots = np.array(list(spline.GetKnotsWithLoopsBaked(_interval(frames)).keys()), dtype=np.float64)
    inner = knots[(knots > frames[0]) & (knots < frames[-1])]
    codes = clock.merged(inner)
    values = np.array([value_at(attribute, code) for code in codes])  # raises a ShotError if a value is not a number
    steps, corners = _breaks(spline, inner, float(np.ptp(values)))
    ramp = STEP * clock.time_codes_per_second
    starts = np.array([max(code - ramp, 0.5 * (code + codes[codes < code].max())) for code in steps])
    breaks = np.unique(np.concatenate([steps, starts, corners]))
    lines = list(zip(starts, steps, strict=True))
    codes = _refined_codes(spline, np.unique(np.concatenate([codes, starts])), breaks, lines, clock, to_si)
    track = _track(spline, codes, breaks, clock, to_si)
    reading.note(f"{path}: the spline is read at its knots and at the frames of the shot")
    _warn_of_breaks(spline, attribute, steps, corners, reading)
    return track


def _interval(frames: Array) -> Gf.Interval:
    return Gf.Interval(float(frames[0]), float(frames[-1]))


def _breaks(spline: Ts.Spline, knots: Array, size: float) -> tuple[Array, Array]:
    """Time codes of the knots at which a spline jumps, and of those at which it has a corner."""
    slopes = np.array([[spline.EvalPreDerivative(k), spline.EvalDerivative(k)] for k in knots]).reshape(-1, 2)
    jumps = np.array([abs(spline.Eval(k) - spline.EvalPreValue(k)) for k in knots])
    step = jumps > _JUMP * max(size, 1e-12)
    steepest = float(np.max(np.abs(slopes), initial=0.0))
    corner = np.abs(np.diff(slopes, axis=1)[:, 0]) > _CORNER * steepest
    return knots[step], knots[corner & ~step]


def _track(spline: Ts.Spline, codes: Array, breaks: Array, clock: Clock, to_si: float) -> Track:
    values = np.array([spline.Eval(code) for code in codes])
    return Track(clock.seconds(codes), to_si * values, clock.seconds(breaks))


def _refined_codes(
    spline: Ts.Spline, codes: Array, breaks: Array, lines: list[tuple[float, float]], clock: Clock, to_si: float
) -> Array:
    """Time codes, refined where the track would differ from the spline by more than the tolerance, except in steps."""
    end = float(clock.seconds(codes[-1]))
    for _ in range(_ROUNDS):
        middles = 0.5 * (codes[:-1] + codes[1:])
        sampled = held_curve(_track(spline, codes, breaks, clock, to_si), end)(clock.seconds(middles), 0)
        far = np.abs(sampled - to_si * np.array([spline.Eval(code) for code in middles])) > _EXACT
        for start, step in lines:
            far &= ~((middles > start) & (middles < step))
        if not far.any():
            break
        codes = np.union1d(codes, middles[far])
    return codes


def _warn_of_breaks(
    spline: Ts.Spline, attribute: Usd.Attribute, steps: Array, corners: Array, reading: Reading
) -> None:
    """Warn of steps and corners, which excite the structure."""
    if len(steps):
        jump = max(steps, key=lambda code: abs(spline.Eval(code) - spline.EvalPreValue(code)))
        reading.warn(
            ShotError(
                f"the spline jumps, which is played within {1e3 * STEP:g} ms and excites the structure",
                path=attribute.GetPrimPath(),
                attribute=attribute.GetName(),
                found=f"{len(steps)} times, most at time code {jump:g}: from {spline.EvalPreValue(jump):.6g} to "
                f"{spline.Eval(jump):.6g}",
                remedy="Replace the step by a smooth transition, unless it is intended",
            )
        )
    if len(corners):
        sharpest = max(corners, key=lambda code: abs(spline.EvalDerivative(code) - spline.EvalPreDerivative(code)))
        reading.warn(
            ShotError(
                "the spline has corners, which excite the structure",
                path=attribute.GetPrimPath(),
                attribute=attribute.GetName(),
                found=f"{len(corners)}, the sharpest at time code {sharpest:g}: from "
                f"{spline.EvalPreDerivative(sharpest):.6g} to {spline.EvalDerivative(sharpest):.6g} a time code",
                remedy="Smooth the tangents, unless the corners are intended",
            )
        )


def value_at(attribute: Usd.Attribute, code: float) -> float:
    """The value of an attribute at a time code, which must be a finite number."""
    value = attribute.Get(code)
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number):
        raise ShotError(
            "a sample of the animation is not a finite number",
            path=attribute.GetPrimPath(),
            attribute=attribute.GetName(),
            found=f"{'a block' if value is None else value} at time code {code:g}",
            remedy="Correct or remove the sample",
        )
    return number


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
    return Track(clock.seconds(codes), to_si * values)


def swings(path: Sdf.Path, track: Track, clock: Clock, to_si: float) -> list[str]:
    """A note where the smooth curve swings far beyond two samples between which frames have none.

    Args:
        track: With what its holds need.
        to_si: Radians, or metres, in its unit.
    """
    span, codes = np.ptp(track.values), clock.time_codes(track.times)
    if len(clock.frame_times()) < 2 or span == 0.0:
        return []
    wide = np.nonzero(np.diff(track.times) > _SPARSE / clock.frames_per_second)[0]
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
