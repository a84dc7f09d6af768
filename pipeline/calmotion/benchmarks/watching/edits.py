"""From edit to result: a watched shot is run, one key of one motor is moved, and it is run again.

Times are those of `calmotion watch`: the second run keeps what the first one made that is still right. The motion is a
file of the motors' tracks, so that a key can be moved in a shot of any kind.
"""

from __future__ import annotations

import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from calmotion.benchmarks.common.tables import markdown
from calmotion.benchmarks.common.timing import processor_time
from calmotion.host import OperatorResult
from calmotion.shot.character import Array
from calmotion.shot.curves import held_curve
from calmotion.shot.run import OutputPaths
from calmotion.workflow.commands import optimize, simulate
from calmotion.workflow.results import OptimizationResult, SimulationResult
from calmotion.workflow.shot import Shot
from calmotion.workflow.watch import Watch

COMMANDS: dict[str, Callable[..., SimulationResult]] = {"simulate": simulate, "optimize": optimize}
SEARCH = "retarget.optimize"
MOVED, REACH = np.radians(3.0), 0.33  # how far a key is moved [rad] or [m / 10], and to where its neighbours are [s]


@dataclass(frozen=True)
class Edit:
    """A run of a watched shot, and the one after one key was moved.

    Attributes:
        shot: Name of the shot.
        command: `simulate` or `optimize`.
        first, again: Processor time of each operator [s].
        first_s, again_s: By the clock [s].
        reused: What the second run took over.
        sweeps: Simulated and linearised sweeps of both searches.
        errors_mm: Largest error of a target after each run.
    """

    shot: str
    command: str
    first: Mapping[str, float]
    again: Mapping[str, float]
    first_s: float
    again_s: float
    reused: Sequence[str]
    sweeps: tuple[int, int]
    errors_mm: tuple[float, float]

    @property
    def compared(self) -> tuple[float, float]:
        """Processor time of the first run and of the second [s]; of their searches where they have one."""
        if self.command == "optimize":
            return self.first.get(SEARCH, 0.0), self.again.get(SEARCH, 0.0)
        return sum(self.first.values()), sum(self.again.values())

    @property
    def ratio(self) -> float:
        """That of the second run over that of the first."""
        first, again = self.compared
        return again / first


def measure_edit(path: str, command: str, tolerance: str | None = None) -> Edit:
    """Run a shot, move a key and run it again.

    Args:
        path: USD file.
        command: `simulate` or `optimize`.
        tolerance: As of the command.

    Raises:
        ShotError: It cannot be processed.
    """
    tracks = tracks_of(Shot(path))
    with tempfile.TemporaryDirectory() as temporary:
        motion, layer = Path(temporary) / "motion.npz", Path(temporary) / "layer.usda"
        np.savez(motion, **tracks)  # type: ignore[arg-type]
        used: defaultdict[str, float] = defaultdict(float)
        state = [processor_time()]

        def done(result: OperatorResult) -> None:
            now = processor_time()
            used[result.idname] += now - state[0]
            state[0] = now

        run = partial(COMMANDS[command], tolerance=tolerance, outputs=OutputPaths(layer=str(layer)), on_operator=done)
        watch = Watch(Shot(path, motion), run)
        times, results, stages = [], [], []
        for _ in range(2):
            begin, state[0] = time.perf_counter(), processor_time()
            used.clear()
            results.append(watch.run())
            times.append(time.perf_counter() - begin)
            stages.append(dict(used))
            np.savez(motion, **with_moved_key(tracks))  # type: ignore[arg-type]
    return Edit(
        Path(path).stem, command, stages[0], stages[1], times[0], times[1], tuple(watch.reused),
        (_sweeps(results[0]), _sweeps(results[1])), (1e3 * results[0].max_error, 1e3 * results[1].max_error),
    )  # fmt: skip


def _sweeps(result: SimulationResult) -> int:
    if not isinstance(result, OptimizationResult):
        return 0
    return result.result.forward_simulations + result.result.linearized_sweeps


def tracks_of(shot: Shot) -> dict[str, Array]:
    """Columns of a shot's motion: the times of its frames [s], and each motor's track [rad or m]."""
    animation = shot.animation
    frames = animation.frame_times
    columns = {"time_s": frames}
    for path, track in zip(shot.motors, animation.tracks, strict=True):
        columns[path] = held_curve(track, frames[-1])(frames, 0)
    return columns


def with_moved_key(columns: Mapping[str, Array]) -> dict[str, Array]:
    """A motion in which one key half way of the motor that moves most was moved, up to its neighbours."""
    times = columns["time_s"]
    path = max((name for name in columns if name != "time_s"), key=lambda name: float(np.ptp(columns[name])))
    away = np.clip(np.abs(times - 0.5 * times[-1]) / REACH, 0.0, 1.0)
    return {**columns, path: columns[path] + MOVED * np.cos(0.5 * np.pi * away) ** 2}


def table(edits: Sequence[Edit]) -> str:
    """The edits as Markdown."""
    heads = [
        "shot", "again", "first: processor time [s]", "after the edit", "ratio", "by the clock [s]", "after the edit",
        "sweeps", "after the edit", "error [mm]", "after the edit", "reused",
    ]  # fmt: skip
    rows = []
    for edit in edits:
        what = "search" if edit.command == "optimize" else "whole run"
        first, again = edit.compared
        numbers = [f"{first:.2f}", f"{again:.2f}", f"{edit.ratio:.2f}", f"{edit.first_s:.2f}", f"{edit.again_s:.2f}"]
        counts = [str(count) if count else "" for count in edit.sweeps]
        errors = [f"{error:.2f}" for error in edit.errors_mm]
        rows.append([edit.shot, f"{edit.command}: {what}", *numbers, *counts, *errors, ", ".join(edit.reused)])
    return markdown(heads, rows, "---:")
