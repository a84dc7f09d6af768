"""A stream that is calmed while it is played, in comparison with input shapers.

`calmotion bench live [SHOT ...]` plays the motion of each shot as a stream at 250 Hz with several look-aheads (shares
of the longest period), and simulates the whole robot with the commands. Errors are root mean squares over all targets
against the intended motion with the sag of each pose, delayed by the look-ahead; those of shapers with the delay that
suits each best. `frequencies` scales those of the robot that is simulated: what is calmed knows the robot as it should
be. Ticks are timed on this machine as it is.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from calmotion.arrays import Array
from calmotion.model import RunSettings
from calmotion.multibody import Model, Workspace
from calmotion.simulation import (
    CompiledShot,
    Curves,
    Prepared,
    best_delay,
    modes_of,
    prepare,
    rigid_motion,
    run_forward,
    sample_curves,
    shaped,
    static_motion,
)
from calmotion_plugins.live import Live, LiveSettings
from scipy.interpolate import CubicSpline

from ..common.parsers import bench_parser, output_options, shots_argument
from ..common.shots import SAMPLES, load
from ..common.tables import show

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


class _Robot:
    """A robot on which commands are tried."""

    def __init__(self, prepared: Prepared, frequencies: float):
        system, self._grid, self._world = prepared.model.system, prepared.grid, prepared.world
        square = frequencies**2
        stiffer = system._replace(stiffness=square * system.stiffness, data=square * system.data)
        self._model: Model = replace(prepared.model, system=stiffer)
        curves = sample_curves(prepared.shot.animation.current, prepared.grid)
        rigid = rigid_motion(prepared.model, curves.angles, curves.rates, self._grid.h, self._world, False)
        always = np.ones(len(self._grid.times), bool)
        self._intended = static_motion(prepared.model, rigid, curves.angles, always, self._world).target_positions

    def left(self, angles: Array, rates: Array, delay: float | None) -> tuple[float, Array]:
        """Delay [s] and distances [m] with curves of shape [T, M]; with the best delay where none is given."""
        grid = self._grid
        workspace = Workspace.for_system(self._model.system)
        found = run_forward(self._model, workspace, angles, rates, grid.h, self._world).target_positions
        if delay is None:
            return best_delay(found, self._intended, grid.judged, grid.h)
        late = np.maximum(np.arange(len(found)) - round(delay / grid.h), 0)
        return delay, np.linalg.norm(found - self._intended[late], axis=2)[grid.judged]


def compare(name: str, shot: CompiledShot, frequencies: tuple[float, ...] = FREQUENCIES) -> Iterator[Row]:
    """All methods on one robot."""
    prepared = prepare(shot, RunSettings())
    grid, modes = prepared.grid, modes_of(prepared)
    curves = sample_curves(shot.animation.current, grid)
    streams = [
        _streamed(shot, CubicSpline(grid.times, curves.angles), grid.times, share / modes[0][0]) for share in SHARES
    ]
    for factor in frequencies:
        robot = _Robot(prepared, factor)
        yield _row(name, "as animated", factor, robot.left(curves.angles, curves.rates, 0.0))
        for kind in KINDS:
            made: Curves = shaped(curves, grid, kind, *modes)
            yield _row(name, kind, factor, robot.left(made.angles, made.rates, None))
        for share, (angles, rates, late, ticks) in zip(SHARES, streams, strict=True):
            found = robot.left(angles, rates, late)
            yield _row(name, f"live, {share:g} of the period", factor, found, ticks["median"], ticks["p99"])


def _streamed(
    shot: CompiledShot, motion: CubicSpline, times: Array, lookahead: float
) -> tuple[Array, Array, float, dict[str, float]]:
    """Commands and their rates at the instants of a simulation, their delay [s], and times of ticks [s]."""
    ticks = np.arange(times[0], times[-1] + 1.0 / RATE, 1.0 / RATE)
    with Live(shot, LiveSettings(rate=RATE, lookahead=lookahead, background=False)) as live:
        live.reset(motion(times[0]))
        found = np.array([live.step(tick, motion(min(tick, times[-1]))) for tick in ticks])
        report = live.report()
    played = CubicSpline(ticks, found)
    return played(times), played(times, 1), report["latency_s"], report["tick_s"]


def _row(
    shot: str, method: str, frequencies: float, left: tuple[float, Array], median: float = 0.0, p99: float = 0.0
) -> Row:
    late, distances = left
    rms = 1e3 * float(np.sqrt(np.mean(distances**2)))
    return Row(shot, method, frequencies, late, rms, 1e3 * float(distances.max()), 1e3 * median, 1e3 * p99)


HEADS = ("method", "frequencies", "delay", "rms error", "largest error", "tick", "99% of ticks")


def cells(rows: list[Row]) -> list[list[str]]:
    """The table for a person, without its heads."""
    return [
        [
            row.method,
            f"{row.frequencies:g}",
            f"{1e3 * row.delay_s:.0f} ms",
            f"{row.rms_mm:.2f} mm",
            f"{row.largest_mm:.2f} mm",
            f"{row.tick_ms:.2f} ms" if row.tick_ms else "",
            f"{row.tick_99_ms:.2f} ms" if row.tick_99_ms else "",
        ]
        for row in rows
    ]


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("live", __doc__)
    shots_argument(parser, SAMPLES)
    output_options(parser)
    options = parser.parse_args(arguments)
    found: list[Row] = []
    for path in options.shots:
        own = list(compare(Path(path).stem, load(path)))
        found += own
        if not options.json:
            show(own[0].shot, HEADS, cells(own))
    if options.json:
        print(json.dumps([asdict(row) for row in found]))
    return 0
