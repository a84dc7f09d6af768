"""Figures of curves: errors over time, motor angles, convergence."""

from collections.abc import Sequence

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Character, Result, Simulation, measure_of
from calmotion.views import AFTER, BEFORE, CHANGE, LIMIT, SMALL, TEXT, new_figure, sample_motion, short, tidy, titles
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

MOST_TARGETS = 8
WIDTH = 9.0
SMALLEST = 1e-3  # range of an axis of errors [mm, deg]: targets that do not move have rounding errors


def runs_of(result: Result) -> list[tuple[Simulation, str, str, str]]:
    """The simulations of a result, with color, line style and name."""
    runs = [(result.before, BEFORE, "--" if result.after else "-", "before" if result.after else "as animated")]
    return runs + ([(result.after, AFTER, "-", "after")] if result.after else [])


def worst_targets(character: Character, result: Result) -> list[int]:
    """The targets with the largest errors of the input, at most `MOST_TARGETS`, as reports have them: by weight."""
    largest = result.before.position_errors[result.before.motion.judged].max(axis=0)
    worst = np.argsort(-largest, kind="stable")[:MOST_TARGETS].tolist()
    return sorted(worst, key=lambda k: -character.targets[k].position_weight)


def plot_errors(character: Character, result: Result) -> Figure:
    """Position error of each target [mm], and its rotation error [deg] where that has a weight; beside both errors
    those after the optimisation alone, which are too small to be seen there."""
    shown = worst_targets(character, result)
    panels = [(k, False) for k in shown]
    panels += [(k, True) for k in shown if character.targets[k].rotation_weight > 0.0]
    names = titles([target.path for target in character.targets])
    runs = runs_of(result)
    figure = new_figure(WIDTH, 0.6 + 1.9 * len(panels))
    ratios = [2.0, 1.0][: len(runs)]
    grid = figure.subplots(len(panels), len(runs), sharex=True, squeeze=False, width_ratios=ratios)
    for row, (k, rotation) in zip(grid, panels, strict=True):
        goal = None if rotation else result.goal_m
        title = names[character.targets[k].path] + (", rotation" if rotation else "")
        _draw_errors(row[0], runs, k, rotation, goal)
        tidy(row[0], "rotation error [deg]" if rotation else "position error [mm]", title)
        row[0].legend(fontsize=SMALL, loc="upper right", framealpha=0.85, edgecolor="none")
        if len(runs) > 1:
            _draw_errors(row[1], runs[1:], k, rotation, goal)
            larger = row[0].get_ylim()[1] / row[1].get_ylim()[1]
            scale = f", enlarged {larger:.{0 if larger > 10.0 else 1}f} times" if larger > 1.05 else ""
            tidy(row[1], row[0].get_ylabel(), f"after{scale}")
    for axes in grid[-1]:
        axes.set_xlabel("time [s]", fontsize=SMALL)
    if len(shown) < len(character.targets):
        note = f"The {len(shown)} of {len(character.targets)} targets with the largest errors"
        figure.supxlabel(note, fontsize=SMALL, color=TEXT)
    return figure


def _draw_errors(
    axes: Axes, runs: Sequence[tuple[Simulation, str, str, str]], target: int, rotation: bool, goal: float | None
) -> None:
    """Errors of a target over time, from zero on, and the goal [m]."""
    for simulation, color, line, name in runs:
        rows = simulation.motion.judged
        errors = simulation.rotation_errors if rotation else simulation.position_errors
        values = np.degrees(errors[rows, target]) if rotation else 1e3 * errors[rows, target]
        unit = "deg" if rotation else "mm"
        text = f"{name}: largest {values.max():.3g} {unit}, rms {np.sqrt(np.mean(values**2)):.3g} {unit}"
        axes.plot(simulation.motion.times[rows], values, line, color=color, linewidth=1.5, label=text)
    if goal is not None:
        axes.axhline(1e3 * goal, color=LIMIT, linewidth=1.0, linestyle=":", label=f"goal {1e3 * goal:g} mm")
    largest = max(float(np.max(line.get_ydata())) for line in axes.get_lines())
    room = 1.35 if len(runs) > 1 else 1.1  # for the legend
    axes.set_ylim(0.0, max(room * largest, SMALLEST))
    axes.margins(x=0.0)


def plot_motors(character: Character, result: Result, motors: Sequence[int]) -> Figure:
    """Angle of each motor [deg], or length [mm], with its limits, and the change by the optimiser."""
    columns = 2 if result.after else 1
    names = titles([motor.path for motor in character.motors])
    figure = new_figure(WIDTH, 0.6 + 1.75 * len(motors))
    grid = figure.subplots(len(motors), columns, sharex=True, squeeze=False)
    times, changes = changes_of(result)
    for row, m in zip(grid, motors, strict=True):
        motor = character.motors[m]
        measure = measure_of(motor)
        for simulation, color, line, name in runs_of(result):
            rows = simulation.motion.judged
            values = measure.factor * simulation.motion.motor_values[rows, m]
            row[0].plot(simulation.motion.times[rows], values, line, color=color, linewidth=1.5, label=name)
        joint = character.joints[motor.joint]
        tidy(row[0], f"{measure.name} [{measure.unit}]", names[motor.path])
        draw_limits(row[0], measure.factor * np.array([joint.lower, joint.upper]), measure.unit)
        if result.after is None:
            continue
        change = measure.factor * changes[:, m]
        row[1].plot(times, change, color=CHANGE, linewidth=1.5)
        row[1].axhline(0.0, color=LIMIT, linewidth=0.7)
        changed = f"{short(motor.path)}: changed by at most {np.abs(change).max():.3g} {measure.unit}"
        tidy(row[1], f"change [{measure.unit}]", changed)
    grid[0, 0].legend(fontsize=SMALL, loc="best", framealpha=0.85, edgecolor="none")
    for axes in grid.flat:
        axes.margins(x=0.0)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]", fontsize=SMALL)
    return figure


def changes_of(result: Result) -> tuple[Array, Array]:
    """Times [s], shape [n], and what the optimiser adds to each motor [rad or m], shape [n, M]; empty before it."""
    if result.after is None:
        return np.empty(0), np.empty((0, result.before.motion.motor_values.shape[1]))
    after, rows = result.after.motion, result.after.motion.judged
    before = sample_motion(result.before.motion, after.times[rows])
    return after.times[rows], after.motor_values[rows] - before.motor_values


def most_changed(character: Character, result: Result) -> list[int]:
    """All motors, those with the largest changes [deg or mm] first; without an optimisation as the robot has them."""
    largest = np.abs(changes_of(result)[1]).max(axis=0, initial=0.0)
    factors = np.array([measure_of(motor).factor for motor in character.motors])
    order: list[int] = np.argsort(-factors * largest, kind="stable").tolist()
    return order


def draw_limits(axes: Axes, limits: np.ndarray, unit: str) -> None:
    """Limits of a joint: as text, and as lines where they are near the curve."""
    if not np.any(np.isfinite(limits)):
        return
    low, high = axes.get_ylim()
    margin = 0.35 * max(high - low, 1e-6)
    for limit in limits:
        if np.isfinite(limit) and low - margin < limit < high + margin:
            axes.axhline(limit, color=LIMIT, linewidth=1.0, linestyle=":")
    text = " to ".join(f"{limit:.0f}" if np.isfinite(limit) else "none" for limit in limits)
    axes.set_title(f"limits {text} {unit}", fontsize=SMALL, loc="right", color=LIMIT)


def plot_convergence(result: Result) -> Figure:
    """Objective and gradient at each iterate over the work that led to it, from the motion as animated on.

    A new line begins where an objective rises: it is that of the same curves in a finer simulation.
    """
    figure = new_figure(WIDTH, 3.2)
    # A step counts the sweeps of its own linear solve as well, which come after its objective is known.
    sweeps = [0, *(step.linearized_sweeps for step in result.search.steps[:-1])]
    work = [step.forward_simulations + before for step, before in zip(result.search.steps, sweeps, strict=True)]
    objectives = [step.objective for step in result.search.steps]
    finer = [k for k in range(1, len(objectives)) if objectives[k] > objectives[k - 1]]
    panels = (("objective", "objective [m² s]"), ("gradient_norm", "norm of the projected gradient [m² s/rad]"))
    for axes, (name, title) in zip(figure.subplots(1, 2), panels, strict=True):
        values = [getattr(step, name) for step in result.search.steps]
        for first, end in zip([0, *finer], [*finer, len(values)], strict=True):
            axes.semilogy(work[first:end], values[first:end], color=AFTER, marker="o", markersize=4)
        if name == "objective" and result.objective_before > 1.001 * values[0]:
            start = [0, work[0]], [result.objective_before, values[0]]
            axes.semilogy(*start, color=BEFORE, marker="o", markersize=4, linestyle="--", zorder=1.5)
            axes.annotate("as animated", (0, result.objective_before), (6, -2), textcoords="offset points",
                          fontsize=SMALL, color=BEFORE, va="top")  # fmt: skip
        for k in finer:
            label = "a finer simulation begins" if k == finer[0] else None
            axes.axvline(work[k], color=LIMIT, linewidth=0.8, linestyle=":", label=label)
        if finer:
            axes.legend(fontsize=SMALL, loc="upper right", framealpha=0.85, edgecolor="none")
        tidy(axes, "", title)
        axes.set_xlim(left=0.0)
        axes.set_xlabel("simulations and linearised sweeps", fontsize=SMALL)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.tick_params(which="both", labelsize=SMALL)
        axes.margins(y=0.12)
    return figure
