"""A stream that is calmed while it is played, in comparison with input shapers.

`calmotion bench live [SHOT ...]` plays the motion of each shot as a stream at 250 Hz with several look-aheads (shares
of the longest period), and simulates the whole robot with the commands. Errors are root mean squares over all targets
against the intended motion with the sag of each pose, delayed by the look-ahead; those of shapers with the delay that
suits each best. `frequencies` scales those of the robot that is simulated: what is calmed knows the robot as it should
be. Ticks are timed on this machine as it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.model import RunSettings
from calmotion.simulation import CompiledShot, Curves, modes_of, prepare, shaped
from calmotion_plugins.live import LiveSettings, Trial

from ..common.reporting import bench_parser, on_shots
from ..common.shots import SAMPLES

RATE = 250.0  # of the stream [Hz]
SHARES = (0.1, 0.2, 0.4, 0.8)  # of the longest period, as look-ahead
FREQUENCIES = (0.9, 1.0, 1.1)
KINDS = ("zv", "zvd", "zv2", "zvd2")


@dataclass(frozen=True)
class Row:
    """One method on one robot.

    Attributes:
        shot, method: Names.
        frequencies: Of the simulated robot, over those of the model.
        delay_s: [s].
        rms_mm, largest_mm: Error at the targets [mm].
        tick_ms, tick_99_ms: Time of a tick: half and 99% of them are faster [ms]; zero of shapers.
    """

    shot: str
    method: str
    frequencies: float
    delay_s: float
    rms_mm: float
    largest_mm: float
    tick_ms: float = 0.0
    tick_99_ms: float = 0.0


def compare(name: str, shot: CompiledShot, frequencies: tuple[float, ...] = FREQUENCIES) -> Iterator[Row]:
    """All methods on one robot."""
    prepared = prepare(shot, RunSettings())
    grid, modes = prepared.grid, modes_of(prepared)
    trial = Trial(prepared)
    curves, longest = trial.curves, 1.0 / modes[0][0]
    streams = [trial.streamed(shot, LiveSettings(rate=RATE, lookahead=share * longest)) for share in SHARES]
    for factor in frequencies:
        robot = Trial(prepared, factor)
        yield _row(name, "as animated", factor, robot.left(curves.angles, curves.rates, 0.0))
        for kind in KINDS:
            made: Curves = shaped(curves, grid, kind, *modes)
            yield _row(name, kind, factor, robot.left(made.angles, made.rates, None))
        for share, (angles, rates, report) in zip(SHARES, streams, strict=True):
            found, ticks = robot.left(angles, rates, report["latency_s"]), report["tick_s"]
            yield _row(name, f"live, {share:g} of the period", factor, found, ticks["median"], ticks["p99"])


def _row(
    shot: str, method: str, frequencies: float, left: tuple[float, Array], median: float = 0.0, p99: float = 0.0
) -> Row:
    late, distances = left
    rms = 1e3 * float(np.sqrt(np.mean(distances**2)))
    return Row(shot, method, frequencies, late, rms, 1e3 * float(distances.max()), 1e3 * median, 1e3 * p99)


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    options = bench_parser("live", __doc__, SAMPLES).parse_args(arguments)
    return on_shots(options, "Streams and shapers", Row, compare)
