"""The motion in pictures: each row is a motion over the silhouette of the intended one, each column an instant."""

from collections.abc import Sequence

import numpy as np
from calmotion.arrays import Array, Indices
from calmotion.model import Animation, Character, Motion, Result, Simulation
from calmotion.support import distinct_names
from calmotion.views import (
    AFTER,
    BEFORE,
    INTENDED,
    NORMAL,
    SMALL,
    TEXT,
    Camera,
    View,
    choose_viewpoint,
    draw_over_ghost,
    fit_camera,
    floor_below,
    framed,
    new_figure,
    prepare,
    sample_motion,
)
from matplotlib.axes import Axes
from matplotlib.figure import Figure

PANEL = 340  # pixels across a panel, before it is drawn into the figure
SMOOTH = 2  # factor of the rendering, which is then averaged
TRAIL_S = 0.5
WIDTH = 12.0
LETTERS = 150  # of titles that stand beside each other


def choose_instants(animation: Animation, result: Result, count: int) -> Array:
    """The frame of the largest error of the input in each of `count` equal parts of the shot; times [s]."""
    frames = animation.frame_times
    errors = result.before.position_errors
    worst = (
        np.interp(frames, result.before.motion.times, errors.max(axis=1)) if errors.shape[1] else np.zeros(len(frames))
    )
    parts = [part for part in np.array_split(np.arange(len(frames)), count) if len(part)]
    return frames[[int(part[np.argmax(worst[part])]) for part in parts]]


def draw_filmstrip(character: Character, animation: Animation, result: Result, count: int) -> Figure:
    """The input and, where there is one, the optimised motion at the instants of the largest errors of the input.

    Args:
        character: The character.
        animation: For the times of its frames.
        result: Of `simulate` or `optimize`.
        count: Number of instants.
    """
    times = choose_instants(animation, result, count)
    model = prepare(character, result.skins)
    view = choose_viewpoint(character, result.skins, sample_motion(result.before.motion, animation.frame_times))
    runs: list[tuple[Simulation, str, str]] = [(result.before, BEFORE, "as animated")]
    if result.after is not None:
        runs.append((result.after, AFTER, "optimised"))
    reference = sample_motion(result.reference, times)
    motions = [sample_motion(run.motion, times) for run, _, _ in runs]
    every = (result.reference, *(run.motion for run, _, _ in runs))
    trails = np.concatenate([trail_of(motion, time).reshape(-1, 3) for motion in every for time in times])
    cloud = framed(view, character, result.skins, (reference, *motions), trails)
    probe = fit_camera(view, cloud, PANEL, PANEL, 0.0).project(cloud)[:, :2]
    aspect = float(np.clip(np.ptp(probe[:, 1]) / max(np.ptp(probe[:, 0]), 1e-9), 0.35, 1.8))
    camera = fit_camera(view, cloud, SMOOTH * PANEL, round(SMOOTH * PANEL * aspect))
    floor = floor_below(model, reference)
    targets = farthest_targets(result.before, times)
    heads = panel_titles(character, [run for run, _, _ in runs], targets, times)
    figure = new_figure(WIDTH, 0.55 + len(runs) * (0.22 * heads[0][0].count("\n") + 0.22 + aspect * WIDTH / len(times)))
    grid = figure.subplots(len(runs), len(times), squeeze=False)
    for row, (run, color, name), motion, titles in zip(grid, runs, motions, heads, strict=True):
        for column, axes in enumerate(row):
            panel = View(model, motion, reference, column, camera, SMOOTH, floor=floor)
            picture = draw_over_ghost(panel)
            axes.imshow(picture, extent=(0, camera.size[0], camera.size[1], 0), interpolation="antialiased")
            draw_trails(axes, character, result.reference, times[column], camera, INTENDED, 1.0)
            draw_trails(axes, character, run.motion, times[column], camera, color, 1.4)
            axes.set_axis_off()
            axes.set_xlim(0, camera.size[0])
            axes.set_ylim(camera.size[1], 0)
            axes.set_title(titles[column], fontsize=SMALL, color=color, pad=2)
        place = {"ha": "right", "va": "center", "transform": row[0].transAxes, "rotation": 90}
        row[0].text(0.0, 0.5, name, fontsize=NORMAL, color=color, fontweight="bold", **place)
    text = "Simulated motion over the intended motion (green) at the largest errors of the input"
    figure.suptitle(text, fontsize=NORMAL, color=TEXT)
    return figure


def panel_titles(character: Character, runs: Sequence[Simulation], targets: Indices, times: Array) -> list[list[str]]:
    """Above each panel of each run its time [s], target and error; in two lines where one would be too long."""
    if not len(targets):
        return [[f"{time:.2f} s" for time in times] for _ in runs]
    paths = [target.path for target in character.targets]
    short = distinct_names(paths)
    names = [short[paths[target]] for target in targets]
    found = []
    for run in runs:
        errors = [error_at(run, int(target), time) for target, time in zip(targets, times, strict=True)]
        values = [f"{1e3 * error:.{1 if error > 1e-3 else 2}f} mm" for error in errors]
        found.append([(f"{time:.2f} s", name, value) for time, name, value in zip(times, names, values, strict=True)])
    if max(len(f"{time}, {name} {value}") for row in found for time, name, value in row) * len(times) <= LETTERS:
        return [[f"{time}, {name} {value}" for time, name, value in row] for row in found]
    return [[f"{time}, {value}\n{name}" for time, name, value in row] for row in found]


def trail_of(motion: Motion, time: float) -> Array:
    """Places of the targets in the last moments before a time [m], shape [60, K, 3]."""
    return sample_motion(motion, np.linspace(max(time - TRAIL_S, 0.0), time, 60)).target_positions


def farthest_targets(run: Simulation, times: Array) -> Indices:
    """The target with the largest error at each of the times, shape [n]; empty where there are no targets."""
    errors = run.position_errors
    if not errors.shape[1]:
        return np.empty(0, dtype=int)
    at = [[error_at(run, target, time) for target in range(errors.shape[1])] for time in times]
    return np.asarray(np.argmax(at, axis=1))


def error_at(run: Simulation, target: int, time: float) -> float:
    """Position error of a target at a time [m]."""
    return float(np.interp(time, run.motion.times, run.position_errors[:, target]))


def draw_trails(
    axes: Axes, character: Character, motion: Motion, time: float, camera: Camera, color: str, width: float
) -> None:
    """The path of each target up to a time [s]."""
    trail = trail_of(motion, time)
    for k in range(len(character.targets)):
        pixels = camera.project(trail[:, k])[:, :2]
        axes.plot(pixels[:, 0], pixels[:, 1], color=color, linewidth=width, solid_capstyle="round")
        axes.plot(pixels[-1:, 0], pixels[-1:, 1], "o", color=color, markersize=2.5)
