"""Retarget a long shot in windows: each goes on from the state in which the last one ends, its inner part is kept."""

from __future__ import annotations

import gc
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Result, WindowRow
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.retargeting.problem.adaptive_knots import FIRST
from calmotion.retargeting.problem.posing import knot_spacing
from calmotion.retargeting.windows.assembly import Done, result_of
from calmotion.retargeting.windows.continued import Beginning, needed_instants
from calmotion.retargeting.windows.parts import Part, Piece, offsets_in, part_of, performed, piece_of
from calmotion.retargeting.windows.plan import FEWEST_FRAMES, Window, overlap_time, plan_windows
from calmotion.retargeting.windows.search import Found, Setting, search_window
from calmotion.retargeting.windows.store import WindowStore, window_keys
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.forward import run_forward
from calmotion.simulation.inputs.curves import Curves, sample_curves
from calmotion.simulation.inputs.open_chains import CLOSED, refuse_open_joints
from calmotion.simulation.inputs.supported import refuse_half_turns
from calmotion.simulation.preparation import Prepared, failure_error, modes_of, prepare
from calmotion.simulation.simulate import Progress, intended_motion
from calmotion.simulation.simulator import compile_kernels
from calmotion.simulation.target_errors import IntendedMotion
from calmotion.support import interrupts

TAIL = 8.0  # distances of knots over which offsets fade out at least


def optimize_windows(
    shot: CompiledShot, options: RunSettings, length: float, progress: Progress, checkpoint: Path | None = None,
    stored: Path | None = None,
) -> Result:  # fmt: skip
    """As `optimize_shot`, in windows in time.

    Args:
        length: Of the windows [s].
        checkpoint: File that stores the search of the window that runs.
        stored: File that stores the windows that are done: an interrupted search goes on behind them, and an edited
            shot is searched again only where it was touched.

    Raises:
        ShotError: The shot cannot be processed.
    """
    begin = time.perf_counter()
    prepared = prepare(shot, options)
    grid = prepared.grid
    frequencies, damping = modes_of(prepared)
    windows = plan_windows(grid.frame_times, length, overlap_time(frequencies, damping, length))
    curves = sample_curves(shot.animation.tracks, grid)
    refuse_half_turns(prepared.character, grid, curves.angles)
    setting = Setting(
        options, tolerance_of(prepared.character, options.tolerance), float(next(iter(frequencies), 0.0)), checkpoint
    )
    try:
        intended = intended_motion(prepared, curves.angles, curves.rates)
        progress(0.0, "loading kernels (compiled in the first run)")
        compile_kernels(
            prepared.model, Workspace.for_system(prepared.model.system), curves.angles, curves.rates, grid.h,
            prepared.world,
        )  # fmt: skip
        offsets = _existing(shot, prepared)
        keys = window_keys(prepared.character, shot.animation, options, grid.h, windows, offsets)
        store = WindowStore(_path_for(stored, offsets), keys)
        store.load(offsets.shape)
        search = _Windows(prepared, windows, curves, intended, setting, store, progress)
        search.run(offsets if store.offsets is None else store.offsets)
        return result_of(prepared, search.done, curves, intended, options, windows, time.perf_counter() - begin)
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure


def _path_for(stored: Path | None, offsets: Array) -> Path | None:
    """A search that begins with what another one found has a file of its own."""
    if stored is None or not np.any(offsets):
        return stored
    return stored.with_name(stored.name.replace(".windows.", ".windows-again."))


def _existing(shot: CompiledShot, prepared: Prepared) -> Array:
    """The offsets that the shot already contains, at its frames, shape [f, M]."""
    animation, grid = shot.animation, prepared.grid
    if animation.current is animation.tracks:
        return np.zeros((len(grid.frame_times), len(animation.tracks)))
    rows = grid.frames
    return sample_curves(animation.current, grid).angles[rows] - sample_curves(animation.tracks, grid).angles[rows]


@dataclass(eq=False)
class _Windows:
    """The windows of a shot, one after the other."""

    whole: Prepared
    windows: tuple[Window, ...]
    curves: Curves
    intended: IntendedMotion
    setting: Setting
    store: WindowStore
    progress: Progress
    done: Done = field(default_factory=Done)

    def run(self, offsets: Array) -> None:
        """Search all windows that are not done, and simulate them.

        Args:
            offsets: With which it begins, at the frames, shape [f, M].
        """
        whole, known = self.whole, needed_instants(self.whole.model, self.whole.grid.h)
        before = after = None
        for k, window in enumerate(self.windows):
            begin = time.perf_counter()
            found, searched = None, not self.store.done[k] and not self.done.interrupted
            if searched:
                if not self.done.searched and k - 1 == self.store.after:
                    after = self.store.beginning or after  # to the last bit that of the search that is resumed
                found = self._searched(k, offsets, after, known)
                if found is not None:
                    offsets = offsets.copy()
                    offsets[window.first : window.last + 1] += found.offsets
                self.done.searched = True
            kept = part_of(whole, window.first, window.kept, known)
            own = kept.curves_of(self.curves)
            before = self._simulated(kept, own, before, self.done.before, known)
            changed = own.plus(offsets_in(kept, offsets, whole.grid).derivatives)
            after = self._simulated(kept, changed, after, self.done.after, known)
            if searched and not self.done.interrupted:
                self.store.keep(k, offsets, None if window.is_last else after)
            self._count(window, searched, found, time.perf_counter() - begin)
        self.done.offsets = offsets

    def _searched(self, k: int, offsets: Array, beginning: Beginning | None, known: int) -> Found | None:
        """The search of one window; an interrupt leaves the others as they are.

        Offsets that vanish at its end would have to leave what is right there; so they do only where the next window
        is not searched, or the overlap is short.
        """
        count, window = len(self.windows), self.windows[k]
        times = self.whole.grid.frame_times
        spacing = knot_spacing(self.whole.character, self.setting.options) or FIRST
        long = times[window.last] - times[window.kept] >= max(FEWEST_FRAMES * times[1], TAIL * spacing)
        ends = bool(long) and not window.is_last and not self.store.done[k + 1]
        part = part_of(self.whole, window.first, window.last, known, ends)
        kept = float(times[window.kept - window.first])

        def progress(fraction: float, message: str) -> None:
            self.progress((k + fraction) / count, f"window {k + 1} of {count}: {message}")

        gc.collect()  # the search before, whose parts refer to each other, would stay in memory beside this one
        try:
            base = offsets_in(part, offsets, self.whole.grid)
            found = search_window(part, kept, self.curves, base, self.intended, beginning, self.setting, progress)
        except KeyboardInterrupt:
            interrupts.answer()
            self.done.interrupted = True
            return None
        if found is not None and found.interrupted:
            self.done.interrupted = True
        return found

    def _simulated(
        self, part: Part, curves: Curves, beginning: Beginning | None, pieces: list[Piece], known: int
    ) -> Beginning:
        """Simulate the kept part of a window by curves of its motors, and the states in which it ends."""
        run = performed(part, curves, beginning)
        options = self.setting.options
        if pieces is self.done.before and run.trajectory.max_joint_gap > CLOSED * self.setting.tolerance:
            self._refuse_open_joints(options)
        pieces.append(piece_of(part, run, self.intended))
        return Beginning.at(run, len(run.target_positions) - 1, known)

    def _refuse_open_joints(self, options: RunSettings) -> None:
        """Refuse motors that contradict each other, by a simulation of the whole shot, which knows its times."""
        whole = self.whole
        workspace = Workspace.for_system(whole.model.system)
        run = run_forward(
            whole.model, workspace, self.curves.angles, self.curves.rates, whole.grid.h, whole.world
        )  # fmt: skip
        refuse_open_joints(whole.character, whole.model, whole.grid, run, options)

    def _count(self, window: Window, searched: bool, found: Found | None, wall: float) -> None:
        times, done = self.whole.grid.frame_times, self.done
        iterations = len(found.search.history) if found is not None else 0
        done.rows.append(
            WindowRow(
                float(times[window.first]), float(times[window.kept]), float(times[window.last]), searched, iterations,
                wall,
            )
        )  # fmt: skip
        if found is not None:
            done.add(found)
