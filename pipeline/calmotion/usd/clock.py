"""Conversion between time codes of a stage and seconds after the first frame of the shot."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pxr import Usd

from calmotion.arrays import Array
from calmotion.errors import ShotError

MOST_FRAMES = 10_000_000  # a day at 120 frames a second
SHORTEST = 1e-6  # [s]
ROUNDING = 1e-3  # of a frame, that time codes may be rounded to
_COARSEST = 10.0  # time codes per second; below this a time code is not a frame


@dataclass(frozen=True)
class Clock:
    """Attributes:
    start, end: Time codes of the first and last frame.
    time_codes_per_second: Time codes in a second.
    frames_per_second: Frames in a second.
    """

    start: float
    end: float
    time_codes_per_second: float
    frames_per_second: float

    def seconds(self, time_codes: npt.ArrayLike) -> Array:
        """Seconds after the first frame of time codes (a value or an array)."""
        return (np.asarray(time_codes, dtype=np.float64) - self.start) / self.time_codes_per_second

    def time_codes(self, seconds: npt.ArrayLike) -> Array:
        """Time codes of seconds after the first frame (a value or an array)."""
        codes = self.start + np.asarray(seconds, dtype=np.float64) * self.time_codes_per_second
        # Frames are mostly whole time codes: do not write 17.000000000000004.
        whole = np.round(codes)
        return np.where(np.abs(codes - whole) < 1e-9 * np.maximum(1.0, np.abs(codes)), whole, codes)

    def frame_times(self) -> Array:
        """Times of the frames [s], shape [f], first 0."""
        count = int(np.floor((self.end - self.start) / self.time_codes_per_second * self.frames_per_second + ROUNDING))
        return np.arange(count + 1) / self.frames_per_second

    def merged(self, time_codes: Array) -> Array:
        """The given time codes within the shot together with those of the frames, ascending; time codes closer than
        1e-6 are merged."""
        inside = time_codes[(time_codes >= self.start) & (time_codes <= self.end)]
        every = np.union1d(self.time_codes(self.frame_times()), inside)
        return np.asarray(every[np.concatenate([[True], np.diff(every) > 1e-6])], dtype=np.float64)


def still_clock(stage: Usd.Stage) -> Clock:
    """The clock of a stage without animation: it has one frame, the first.

    Raises:
        ShotError: A rate that is not positive.
    """
    authored = float(stage.GetStartTimeCode())
    start = authored if np.isfinite(authored) else 0.0
    return Clock(start, start, *_rates(stage))


def _rates(stage: Usd.Stage) -> tuple[float, float]:
    """Time codes per second and frames per second; see `clock_of` for unauthored frame rates."""
    rate = float(stage.GetTimeCodesPerSecond())
    unauthored = rate if rate >= _COARSEST else float(stage.GetFramesPerSecond())
    layers = [layer for layer in (stage.GetSessionLayer(), stage.GetRootLayer()) if layer]
    frames = next((x.framesPerSecond for x in layers if x.HasFramesPerSecond()), unauthored)
    for name, value in (("timeCodesPerSecond", rate), ("framesPerSecond", frames)):
        if not (np.isfinite(value) and value > 0.0):
            raise ShotError(
                "must be positive",
                path=stage.GetRootLayer().identifier,
                attribute=name,
                found=value,
                remedy="Author a positive rate",
            )
    return rate, float(frames)


def clock_of(stage: Usd.Stage, sample_codes: Array) -> Clock:
    """The clock of a stage.

    The stage gives the range; where start or end is not authored, the samples give it. The frame rate is
    framesPerSecond where that is authored, else one frame per time code. Below 10 time codes per second a time code is
    not a frame, and USD's fallback of 24 frames per second holds.

    Args:
        sample_codes: Time codes of the samples of all motors.

    Raises:
        ShotError: The shot has no duration.
    """
    root = stage.GetRootLayer()
    session = stage.GetSessionLayer()
    layers = [layer for layer in (session, root) if layer]
    start = next((x.startTimeCode for x in layers if x.HasStartTimeCode()), None)
    end = next((x.endTimeCode for x in layers if x.HasEndTimeCode()), None)
    authored = start is not None or end is not None
    if start is None and len(sample_codes):
        start = float(np.min(sample_codes))
    if end is None and len(sample_codes):
        end = float(np.max(sample_codes))
    rate, frames = _rates(stage)
    if start is None or end is None or not end > start:
        raise ShotError(
            "the shot has no duration",
            path=root.identifier,
            attribute="endTimeCode",
            found=f"startTimeCode {start}, endTimeCode {end}" if authored else "samples at one time code only",
            remedy="Author startTimeCode and a later endTimeCode in the root layer, and animate within them",
        )
    clock = Clock(float(start), float(end), rate, float(frames))
    seconds = (clock.end - clock.start) / rate
    if not seconds * frames < MOST_FRAMES:
        raise ShotError(
            f"the shot has too many frames (at most {MOST_FRAMES} are supported)",
            path=root.identifier,
            attribute="endTimeCode",
            found=f"startTimeCode {start:g}, endTimeCode {end:g} at {rate:g} a second, {frames:g} frames a second",
            remedy="Author the range and the rates of the shot in the root layer",
        )
    apart = np.spacing(max(abs(clock.start), abs(clock.end))) / rate  # of two time codes that can be told apart [s]
    if not apart * frames < ROUNDING:
        raise ShotError(
            "the time codes of its frames cannot be told apart: they are too large",
            path=root.identifier,
            attribute="endTimeCode",
            found=f"startTimeCode {start:g}, endTimeCode {end:g}",
            remedy="Move the animation to smaller time codes, or reference it with a time offset",
        )
    if not seconds > SHORTEST:
        raise ShotError(
            "the shot is shorter than a microsecond",
            path=root.identifier,
            attribute="endTimeCode",
            found=f"{seconds:g} s",
            remedy="Author the range and the rates of the shot in the root layer",
        )
    return clock
