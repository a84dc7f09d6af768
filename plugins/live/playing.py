"""A stream from its source to its sink: by the clock of its stamps, or by that of the wall."""

import time
from collections.abc import Iterable, Iterator

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Animation
from scipy.interpolate import CubicSpline

from .lines import Sample, Sink, Source
from .session import Live
from .stream import Stream

REST_S = 2.0  # after the end of a stream, until the robot rests
LONGEST_PAUSE_S = 60.0  # by the stamps of a file
SPIN_S = 2e-3  # before a tick, in which waiting does not sleep


def play_stamps(live: Live, samples: Iterable[Sample], sink: Sink, seconds: float | None = None) -> None:
    """Each tick with the samples whose stamps have come, as fast as they can be read: no clock changes the result.

    A pause is played; a stamp that leaps back, or further than a pause, begins the clock anew.
    """
    most = np.inf if seconds is None else round(seconds / live.tick_s)
    begin, ticks, last = None, 0, None
    for stamp, joints in samples:
        if ticks >= most:
            break
        if np.isfinite(stamp):
            if begin is None or last is None or not -Stream.RESTART_S <= stamp - last <= LONGEST_PAUSE_S:
                begin = stamp - ticks * live.tick_s
            last = stamp
            while ticks < most and stamp > begin + (ticks + 1e-3) * live.tick_s:
                _tick(live, sink, begin + ticks * live.tick_s)
                ticks += 1
        _give(live, stamp, joints)
    if begin is None:
        return
    for tick in range(ticks, ticks + 1 + _ticks_to_rest(live)):
        _tick(live, sink, begin + tick * live.tick_s)
        live.end()


def play_clock(live: Live, source: Source, sink: Sink, seconds: float | None = None) -> None:
    """A tick each 1/rate of the wall's clock, until the source ends or `seconds` are over, and then to rest."""
    begin, ticks, left = time.perf_counter(), 0, None
    try:
        while left is None or left > 0:
            arrived = source.arrived() if left is None else []
            for sample in arrived or ():
                _give(live, *sample)
            if arrived is None:
                live.end()
            over = arrived is None or (seconds is not None and ticks * live.tick_s >= seconds)
            left = (_ticks_to_rest(live) if over else None) if left is None else left - 1
            _tick(live, sink, ticks * live.tick_s)
            ticks += 1
            _wait(begin + ticks * live.tick_s)
    finally:
        source.close()


def samples_of_animation(live: Live, animation: Animation) -> Iterator[Sample]:
    """The animation of a shot as a stream, at the rate of the player."""
    end = float(animation.frame_times[-1])
    curves = [CubicSpline(t.times, t.values) if len(t.times) > 1 else None for t in animation.current]

    def at(instant: float) -> Array:
        return np.array(
            [
                float(curve(np.clip(instant, track.times[0], track.times[-1]))) if curve else float(track.values[0])
                for curve, track in zip(curves, animation.current, strict=True)
            ]
        )

    for tick in range(int(end / live.tick_s) + 1):
        instant = tick * live.tick_s
        yield instant, dict(zip(live.joints, at(instant).tolist(), strict=True))


def _give(live: Live, time_s: float, joints: dict[str, float]) -> None:
    """A sample; joints that the robot does not have are left out, and counted."""
    known = {path: value for path, value in joints.items() if path in live.names}
    live.unknown.update(joints.keys() - known.keys())
    live.give(time_s, known)


def _tick(live: Live, sink: Sink, now: float) -> None:
    commands = live.advance()
    sink.send(now, dict(zip(live.joints, commands.tolist(), strict=True)), live)


def _ticks_to_rest(live: Live) -> int:
    late = live.ahead_s + live.latency_s + 2.0 * live.settings.lookahead
    return round((late + REST_S) * live.settings.rate)


def _wait(until: float) -> None:
    left = until - time.perf_counter()
    if left > SPIN_S:
        time.sleep(left - SPIN_S)
    while time.perf_counter() < until:
        pass
