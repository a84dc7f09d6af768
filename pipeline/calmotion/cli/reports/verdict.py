"""What a report of `simulate` and `optimize` says first: the error of each target, how accurate it is, what remains."""

import math
from typing import Any

from rich.console import Console

from calmotion.cli.reports.limits import print_reason
from calmotion.cli.tables import about, counted, length, say
from calmotion.model.result import LIMITS_EXCEEDED
from calmotion.model.tolerance import CHOICES, MEASURED, MESH, REDUCTION, STEP, SUBSPACE
from calmotion.support.naming import distinct_names

# What helps where an entry of the error budget is too large.
_SENSITIVE = "With large deflections, or near buckling, small errors grow: use a stiffer robot or a slower motion."
REMEDIES = {
    MESH: "Ask for finer meshes by --tolerance, or use smaller elements: calm:flexible:elementSize of the body.",
    STEP: f"Use a --step shorter than {{step}}. {_SENSITIVE}",
    REDUCTION: f"Remove calm:flexible:modeCount and calm:flexible:elasticity, or use a larger tolerance. {_SENSITIVE}",
    SUBSPACE: f"Use --keep directions. {_SENSITIVE}",
    CHOICES: "Use --keep all.",
    MEASURED: _SENSITIVE,
}
NOTHING_SHAKES = "nothing shakes: all bodies are rigid and all motors ideal"
HEADLINES, MOTORS = 3, 6  # targets, and motors, that have a place in a sentence
CAUSES = {
    "limits": "motors are at their limits (see the table of limits)",
    "plugins": "residuals or limits of plugins count as well (see the notes)",
    "search": "the search ended early (see below)",
    "sag": "gravity alone causes half of it, even at rest",
    "motors": "{motors} cannot follow {targets}",
    "weight": "other targets have larger weights",
    "reach": "these motors cannot reduce it further, and the search has converged",
}


def is_optimized(report: dict[str, Any]) -> str:
    """Suffix of the numbers of the motion that results."""
    return "_after" if "objective_after" in report else ""


def main_target_first(report: dict[str, Any]) -> list[dict[str, Any]]:
    """The targets, the main one first, then that which the animation leaves farthest off."""
    before = f"max_error{'_before' if is_optimized(report) else ''}_m"
    return sorted(report["targets"], key=lambda row: (row["path"] != report["main_target"], -row[before]))


def print_verdict(console: Console, report: dict[str, Any]) -> None:
    """The largest error of each target, before and after, and whether the simulation keeps the tolerance."""
    rows = main_target_first(report)
    if is_still(report):
        say(console, f"{NOTHING_SHAKES[:1].upper()}{NOTHING_SHAKES[1:]}.")
    elif is_optimized(report):
        changed = any(motor["changed"] for motor in report["motors"])
        if report["improved"] is False:
            say(console, "The new curves are worse than the animation.")
        elif not changed:
            say(console, "No curve was changed: what a change would gain is too little for this tolerance or goal.")
        for row in rows[:HEADLINES]:
            before, after = (length(row[f"max_error_{when}_m"]) for when in ("before", "after"))
            after = after if changed else before  # which differ by how they were simulated
            falls = row["max_error_after_m"] < row["max_error_before_m"]
            change = f"{'falls' if falls else 'rises'} from {before} to {after}"
            _say_of(console, row, rows, "The largest error", f"stays at {after}" if before == after else change)
    else:
        shaper, motion = report.get("shaper"), "As animated"
        if shaper:
            motion = "With the low-pass filter" if shaper == "lowpass" else f"With the shaper {shaper}"
        for row in rows[:HEADLINES]:
            _say_of(console, row, rows, f"{motion}, the largest error", f"is {length(row['max_error_m'])}")
        if shaper and report["shaper_delay_s"] > 0.0:
            late, without = f"{report['shaper_delay_s']:.3f} s", length(report["delayed_max_error_m"])
            say(console, f"It delays the motion by {late}; without this delay the largest error is {without}.")
    if len(rows) > HEADLINES and not is_still(report):
        after = f"max_error{is_optimized(report)}_m"
        worst = max(rows[HEADLINES:], key=lambda row: float(row[after]))
        largest = worst[after] > max(row[after] for row in rows[:HEADLINES])
        more = f", with up to {length(worst[after])} (at {worst['path']})" if largest else ""
        say(console, f"The table has {counted(len(rows) - HEADLINES, 'more target')}{more}.")
    if is_optimized(report):
        print_reason(console, report)
        _print_goal(console, report)
    if report.get("calibration_error_m") and rows and not is_still(report):
        off, together = (length(report[name]) for name in ("calibration_error_m", "max_error_with_calibration_m"))
        say(console, f"Recordings were off the calibrated robot by up to {off}: expect {together} on the machine.")
    _print_accuracy(console, report)


def _print_goal(console: Console, report: dict[str, Any]) -> None:
    """Whether the goal is reached at every target that counts."""
    goal = report["goal_m"]
    if goal is None:
        return
    if report["goal_kept"]:
        say(console, f"The goal is reached: the largest error is at most {length(goal)}.")
    else:
        rows = [row for row in main_target_first(report) if not row["goal_kept"]]
        left = ", ".join(f"{length(row['max_error_after_m'])} at {row['path']}" for row in rows[:HEADLINES])
        more = f" and {counted(len(rows) - HEADLINES, 'more target')}" if len(rows) > HEADLINES else ""
        ended = report["stopped"] in ("converged", "no further decrease", LIMITS_EXCEEDED)
        how = "is out of reach with these motors, limits and weights" if ended else "is not reached"
        say(console, f"The goal of {length(goal)} {how}: {left}{more}.")
    error, worst = report["simulation_error_m"], max(row["max_error_after_m"] for row in report["targets"])
    apart = abs(worst - goal)  # the verdict is that of the target which is farthest off
    if error is not None and error > apart:
        finer = f"--tolerance {1e3 * max(apart, 0.1 * goal):.1g}mm"
        said = f"The simulation, with an error of {about(error)}, is too coarse to decide about the goal"
        say(console, f"{said}: use {finer}.")


def _say_of(console: Console, row: dict[str, Any], rows: list[dict[str, Any]], what: str, is_so: str) -> None:
    """A sentence on the largest error of a target; further ones are shorter than that of the main target."""
    path = row["path"]
    say(console, f"{what} {is_so} (at {path})." if row is rows[0] else f"At {path}, it {is_so}.")


def _print_accuracy(console: Console, report: dict[str, Any]) -> None:
    """Whether the simulation keeps the tolerance, and what helps where it does not."""
    tolerance = length(report["tolerance_m"])
    if report["tolerance_kept"]:
        error = about(report["simulation_error_m"]).replace("<", "less than")
        which = "errors after the optimisation" if is_optimized(report) else "these errors"
        say(console, f"The simulation keeps the tolerance of {tolerance}: {which} are accurate to {error}.")
    elif report["simulation_error_m"] is None:
        say(console, f"The accuracy of the simulation was not estimated (tolerance {tolerance}).")
    else:
        source, error = report["tolerance_missed_by"], about(report["simulation_error_m"])
        cause = f"its own error is about {error}, mostly from the {source}"
        remedy = REMEDIES[source].format(step=f"{1000 * report['step_s']:.3g} ms")
        say(console, f"The simulation does not keep the tolerance of {tolerance}: {cause}. {remedy}")


def print_remaining(console: Console, report: dict[str, Any]) -> None:
    """How far the motor curves changed, and why errors remain that are larger than the tolerance."""
    if not is_optimized(report):
        return
    names = distinct_names([row["path"] for row in report["motors"]])
    angles, lengths = ("angles", "max_offset_rad", math.degrees(1.0), "°"), ("lengths", "max_offset_m", 1e3, " mm")
    for kind, key, scale, unit in (angles, lengths):
        changed = sorted((r for r in report["motors"] if r["changed"] and key in r), key=lambda row: -row[key])
        told = [f"{names[row['path']]} {scale * row[key]:.3g}{unit}" for row in changed[:MOTORS]]
        told += [f"{len(changed) - MOTORS} more by less"] if len(changed) > MOTORS else []
        if told:
            say(console, f"Largest changes of motor {kind}: {', '.join(told)}.")
    groups: dict[str, list[str]] = {}
    for row in sorted(report["remaining_errors"], key=lambda row: -row["max_error_m"]):
        targets = "the targets in all {directions} directions, and the weights (CalmTargetAPI) decide between them"
        if row["directions"] <= 3:  # a position or a rotation: nothing is weighed against it
            targets = "the target in all 3 directions"
        words = {"motors": counted(row["motors"], "motor"), "targets": targets.format(**row)}
        causes = "; ".join(CAUSES[cause].format(**words) for cause in row["causes"])
        groups.setdefault(causes, []).append(f"{length(row['max_error_m'])} at {row['path']}")
    for causes, errors in groups.items():
        more = f" and {counted(len(errors) - HEADLINES, 'more target')}" if len(errors) > HEADLINES else ""
        say(console, f"Why {', '.join(errors[:HEADLINES])}{more} remain: {causes}.")


def is_still(report: dict[str, Any]) -> bool:
    """Whether nothing can shake, and nothing is off."""
    return not report["can_shake"] and not shakes(report)


def shakes(report: dict[str, Any]) -> bool:
    """Whether a target is farther off than the tolerance in the input, in position or in rotation as it counts."""
    before = "_before" if is_optimized(report) else ""
    position, rotation = f"max_error{before}_m", f"max_rotation_error{before}_rad"
    return any(
        max(target[position], target["rotation_weight"] ** 0.5 * target[rotation]) > report["tolerance_m"]
        for target in report["targets"]
    )
