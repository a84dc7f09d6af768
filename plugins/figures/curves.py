"""Figures of curves: errors over time, motor angles, convergence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from calmotion.model import Character, Result, Simulation, measure_of
from calmotion.views import AFTER, BEFORE, INTENDED, LIMIT, SMALL, TEXT, new_figure, sample_motion, tidy, titles
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

MOST_TARGETS = 8
WIDTH = 9.0
DECADES_DOWN = 1e-4  # of the largest error: lower end of a logarithmic axis, at least


def runs_of(result: Result) -> list[tuple[Simulation, str, str, str]]:
    """The simulations of a result, with color, line style and name."""
    runs = [(result.before, BEFORE, "--" if result.after else "-", "before" if result.after else "as animated")]
    return runs + ([(result.after, AFTER, "-", "after")] if result.after else [])


def worst_targets(result: Result) -> list[int]:
    """The targets with the largest errors of the input, at most `MOST_TARGETS`, in the order of the shot."""
    largest = result.before.position_errors[result.before.motion.judged].max(axis=0)
    return sorted(np.argsort(-largest, kind="stable")[:MOST_TARGETS].tolist())


def plot_errors(character: Character, result: Result) -> Figure:
    """Position error of each target [mm], and its rotation error [deg] where that has a weight."""
    shown = worst_targets(result)
    panels = [(k, False) for k in shown]
    panels += [(k, True) for k in shown if character.targets[k].rotation_weight > 0.0]
    names = titles([target.path for target in character.targets])
    figure = new_figure(WIDTH, 0.6 + 1.9 * len(panels))
    all_axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (k, rotation) in zip(all_axes, panels, strict=True):
        for simulation, color, line, name in runs_of(result):
            rows = simulation.motion.judged
            errors = simulation.rotation_errors if rotation else simulation.position_errors
            values = np.degrees(errors[rows, k]) if rotation else 1e3 * errors[rows, k]
            unit = "deg" if rotation else "mm"
            text = f"{name}: largest {values.max():.3g} {unit}, rms {np.sqrt(np.mean(values**2)):.3g} {unit}"
            axes.plot(simulation.motion.times[rows], values, line, color=color, linewidth=1.5, label=text)
        if result.goal_m is not None and not rotation:
            axes.axhline(
                1e3 * result.goal_m, color=LIMIT, linewidth=1.0, linestyle=":", label=f"goal {1e3 * result.goal_m:g} mm"
            )
        title = names[character.targets[k].path] + (", rotation" if rotation else "")
        tidy(axes, "rotation error [deg]" if rotation else "position error [mm]", title)
        scale_errors(axes, result.after is not None)
        axes.margins(x=0.0)
        axes.legend(fontsize=SMALL, loc="upper right", framealpha=0.85, edgecolor="none")
    all_axes[-1].set_xlabel("time [s]", fontsize=SMALL)
    if len(shown) < len(character.targets):
        note = f"The {len(shown)} of {len(character.targets)} targets with the largest errors"
        figure.supxlabel(note, fontsize=SMALL, color=TEXT)
    return figure


def scale_errors(axes: Axes, optimized: bool) -> None:
    """From zero on, or logarithmic where small errors are beside large ones."""
    values = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.get_lines()])
    largest = float(values.max(initial=0.0))
    if not optimized or largest <= 0.0:
        axes.set_ylim(bottom=0.0)
        return
    axes.set_yscale("log")
    # a curve that passes through zero would reach down without end
    axes.set_ylim(
        max(0.5 * float(np.percentile(values, 2.0)), DECADES_DOWN * largest), 12.0 * largest
    )  # room for the legend
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def plot_motors(character: Character, result: Result, motors: Sequence[int]) -> Figure:
    """Angle of each motor [deg], or length [mm], with its limits, and the change by the optimiser."""
    columns = 2 if result.after else 1
    names = titles([motor.path for motor in character.motors])
    figure = new_figure(WIDTH, 0.6 + 1.75 * len(motors))
    grid = figure.subplots(len(motors), columns, sharex=True, squeeze=False)
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
        rows = result.after.motion.judged
        after = result.after.motion
        before = sample_motion(result.before.motion, after.times[rows])
        change = measure.factor * (after.motor_values[rows, m] - before.motor_values[:, m])
        row[1].plot(after.times[rows], change, color=INTENDED, linewidth=1.5)
        row[1].axhline(0.0, color=LIMIT, linewidth=0.7)
        tidy(row[1], f"change [{measure.unit}]", f"largest {np.abs(change).max():.2f} {measure.unit}")
    grid[0, 0].legend(fontsize=SMALL, loc="best", framealpha=0.85, edgecolor="none")
    for axes in grid.flat:
        axes.margins(x=0.0)
    for axes in grid[-1]:
        axes.set_xlabel("time [s]", fontsize=SMALL)
    return figure


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

    An objective that rises is that of the same curves in a finer simulation: a new line begins there.
    """
    figure = new_figure(WIDTH, 3.2)
    # A step counts the sweeps of its own linear solve as well, which come after its objective is known.
    sweeps = [0, *(step.linearized_sweeps for step in result.search.steps[:-1])]
    work = [step.forward_simulations + before for step, before in zip(result.search.steps, sweeps, strict=True)]
    objectives = [step.objective for step in result.search.steps]
    finer = [k for k in range(1, len(objectives)) if objectives[k] > objectives[k - 1]]
    told = sorted(finer, key=lambda k: objectives[k] / objectives[k - 1])[-1:]  # where it makes most of a difference
    panels = (
        ("objective", "objective [m² s]", AFTER),
        ("gradient_norm", "norm of the projected gradient [m² s/rad]", INTENDED),
    )
    for axes, (name, title, color) in zip(figure.subplots(1, 2), panels, strict=True):
        values = [getattr(step, name) for step in result.search.steps]
        for first, end in zip([0, *finer], [*finer, len(values)], strict=True):
            axes.semilogy(work[first:end], values[first:end], color=color, marker="o", markersize=4)
        if name == "objective" and result.objective_before > 1.001 * values[0]:
            start = [0, work[0]], [result.objective_before, values[0]]
            axes.semilogy(*start, color=BEFORE, marker="o", markersize=4, linestyle="--", zorder=1.5)
            axes.annotate("as animated", (0, result.objective_before), (6, -2), textcoords="offset points",
                          fontsize=SMALL, color=BEFORE, va="top")  # fmt: skip
        for k in told:
            axes.annotate("finer simulation", (work[k], values[k]), (0, 6), textcoords="offset points",
                          fontsize=SMALL, color=LIMIT, ha="right" if 2 * work[k] > work[-1] else "left")  # fmt: skip
        tidy(axes, "", title)
        axes.set_xlim(left=0.0)
        axes.set_xlabel("simulations and linearised sweeps (one dot for each iteration)", fontsize=SMALL)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.tick_params(which="both", labelsize=SMALL)
        axes.margins(y=0.12)
    return figure
