"""The report of `simulate` and `optimize` for a person."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from calmotion.cli.reports.feet import print_contacts, print_support
from calmotion.cli.reports.limits import print_left_out, print_limits, print_retiming, print_terms
from calmotion.cli.reports.verdict import (
    is_optimized,
    is_still,
    main_target_first,
    print_remaining,
    print_verdict,
    shakes,
)
from calmotion.cli.tables import SHORTENED, about, angle, length, print_table, say, with_texts
from calmotion.model.result import GOAL_REACHED
from calmotion.support.naming import distinct_names

LONG_PATH = 60  # characters of a prim path from which on sentences and tables have its last names alone
SHORT_STAGE = 0.1  # processor time of a stage that is not listed [s]
FRICTION = 0.1  # of the tolerance, from which on what friction may hold is told
COARSE_EFFORT = 0.05  # of the largest effort of a motor, from which on its error is told
IDLE_EFFORT = 0.01  # of that of the strongest motor


def print_notes(console: Console, notes: Sequence[str]) -> None:
    """The notes of the reader in a file; on a terminal they were printed when the shot was read."""
    for note in () if console.is_terminal else notes:
        say(console, f"note: {note}")


def print_shares(console: Console, shares: Sequence[dict[str, Any]]) -> None:
    """The parts of compliant motors and of flexible links in the error of the input."""
    rows = [[row["path"], length(row["motors_m"]), length(row["links_m"])] for row in shares]
    heads = ["target", "compliant motors", "links that bend"]
    print_table(console, "Largest error as animated, by its cause alone", heads, rows)


def print_lost_motion(console: Console, lost: dict[str, Any] | None, suffix: str) -> None:
    """What the play of gears would do at the target that it moves farthest.

    Args:
        suffix: Of the keys of the result's own values.
    """
    if not lost or not lost["targets"]:
        return
    worst = max(lost["targets"], key=lambda row: row[f"max_error{suffix}_m"])
    turned = [motor for motor in lost["motors"] if motor[f"reversals{suffix}"]]
    count = sum(motor[f"reversals{suffix}"] for motor in turned)
    before = f" (as animated {length(worst['max_error_before_m'])})" if suffix else ""
    say(
        console,
        f"backlash is not simulated; it would move {worst['path']} by up to {length(worst[f'max_error{suffix}_m'])}"
        f"{before}, since the torques of {len(turned)} of {len(lost['motors'])} motors change their sign {count} times"
        if turned
        else "backlash costs nothing: the torques of the motors keep their signs",
    )
    unfollowed = ", ".join(motor["path"] for motor in lost["motors"] if not motor["followed"])
    if unfollowed:
        say(console, f"this leaves out the backlash of {unfollowed}, which closed chains of rigid links cannot follow")


def print_joint_gap(console: Console, gap: float) -> None:
    """The largest gap of a joint [m], where joints are not closed."""
    from calmotion.tolerance.step_error import CLOSED_GAP  # loads what has simulated before

    if gap > CLOSED_GAP:
        say(console, f"joints come apart by up to {length(gap)}")


def print_efforts(console: Console, efforts: Sequence[dict[str, Any]], step: float) -> None:
    """The motor whose efforts depend most on the time step, where that is more than a little.

    A motor that hardly works among the others, such as one that turns a cup, does not count.

    Args:
        step: The time step [s].
    """
    known = [row for row in efforts if row["estimated_error"] is not None and row["largest"] > 0.0]
    strongest: dict[str, float] = {}
    for row in known:
        strongest[row["unit"]] = max(strongest.get(row["unit"], 0.0), row["largest"])
    known = [row for row in known if row["largest"] > IDLE_EFFORT * strongest[row["unit"]]]
    worst = max(known, key=lambda row: row["estimated_error"] / row["largest"], default=None)
    if worst and worst["estimated_error"] >= COARSE_EFFORT * worst["largest"]:
        error, largest = (f"{worst[key]:.3g} {worst['unit']}" for key in ("estimated_error", "largest"))
        said = f"that of {worst['path']}, at most {largest}, may be off by {error}"
        remedy = f"Where efforts matter, use a --step shorter than {1000 * step:.3g} ms."
        say(console, f"efforts of motors are less accurate than positions: {said}. {remedy}")


def print_budget(console: Console, report: dict[str, Any]) -> None:
    """The error budget of the simulation itself, and its measured error."""
    rows = [
        [
            entry["source"],
            about(entry["allowed_m"]),
            "unknown" if entry["estimated_m"] is None else about(entry["estimated_m"]),
        ]
        for entry in report["error_budget"]
    ]
    print_table(console, "Error budget", ["source", "allowed", "estimated"], rows)
    if report["verified_error_m"] is not None:
        say(
            console,
            f"measured simulation error {length(report['verified_error_m'])}, against a run with steps of "
            f"{1000 * report['verified_step_s']:.4g} ms and {report['verified_modes']} elastic coordinates, "
            f"whose meshes may be off by {length(report['verified_mesh_error_m'])}",
        )


def print_robustness(console: Console, report: dict[str, Any]) -> None:
    """The curves on robots that differ from the model."""
    if "scenarios" not in report:
        return
    main = next(target for target in report["targets"] if target["path"] == report["main_target"])
    nominal, robust = (main["robustness"][name]["p95_max_error_m"] for name in ("nominal", "robust"))
    if nominal is not None and robust is not None and robust < nominal:
        say(console, f"On 95% of the robots around the model, the error at {main['path']} is at most {length(robust)}.")
        say(console, f"The curves for the model alone would leave up to {length(nominal)} there.")
    names = {"before": "as animated", "nominal": "optimised for the model", "robust": "robust"}
    for title, key, shown in (("error", "error_m", length), ("rotation error", "rotation_error_rad", angle)):
        rows = []
        for target in report["targets"] if key == "error_m" else [t for t in report["targets"] if t["rotation_weight"]]:
            for name, curves in names.items():
                values = [
                    target["robustness"][name][f"{head}_max_{key}"] for head in ("nominal", "median", "p95", "worst")
                ]
                rows.append([target["path"], curves, *("failed" if v is None else shown(v) for v in values)])
        title = f"Largest {title} on {report['draws']} random robots"
        print_table(console, title, ["target", "curves", "model", "median", "95%", "worst"], rows, texts=2)
    if all(target["robustness"]["robust"] == target["robustness"]["nominal"] for target in report["targets"]):
        say(
            console,
            "No robust curves were found that keep the allowed error on the model. The layer has the curves for the "
            "model alone.",
        )


def print_run(report: dict[str, Any], console: Console, verbose: bool = False) -> None:
    """The report of `simulate` or `optimize`: the answer, the files, what needs attention, and the simplifications.

    Args:
        console: Where it is printed.
        verbose: Whether the search, the steps, the error budget and the notes are printed as well.
    """
    report, shortened = _with_short_paths(report)
    print_verdict(console, report)
    print_retiming(console, report["retime"])
    print_errors(console, report, verbose)
    print_remaining(console, report)
    print_robustness(console, report)
    print_files(console, report)
    print_warnings(console, report)
    if verbose or not report["tolerance_kept"] or report["verified_error_m"] is not None:
        print_budget(console, report)
    if verbose:
        print_work(console, report)
        print_notes(console, report["notes"])
    print_left_out(console, report["left_out"], verbose)
    if shortened:
        say(console, SHORTENED)


def _with_short_paths(report: dict[str, Any]) -> tuple[dict[str, Any], bool]:
    """The report with the last names of long prim paths, and whether it has some."""
    paths = [row["path"] for kind in ("targets", "limits", "efforts", "contacts") for row in report[kind]]
    names = {path: f"…/{name}" for path, name in distinct_names(paths).items() if len(path) > LONG_PATH}
    return with_texts(report, lambda text: names.get(text, text)), bool(names)


def print_errors(console: Console, report: dict[str, Any], verbose: bool = False) -> None:
    """Errors of each target, before and after where the shot was optimised.

    Args:
        verbose: Whether rotations are printed also of targets whose rotation has no weight.
    """
    suffixes = ["_before", "_after"] if is_optimized(report) else [""]
    heads = [f"{kind}{' ' + s[1:] if s else ''}" for kind in ("max", "rms") for s in suffixes]
    for title, unit, shown in (("Position", "m", length), ("Rotation", "rad", angle)):
        name = "error" if unit == "m" else "rotation_error"
        keys = [f"{kind}_{name}{suffix}_{unit}" for kind in ("max", "rms") for suffix in suffixes]
        targets = [t for t in main_target_first(report) if verbose or unit == "m" or t["rotation_weight"] > 0.0]
        rows = [[target["path"], *(shown(target[key]) for key in keys)] for target in targets]
        print_table(console, f"{title} error of the targets", ["target", *heads], rows)


def print_files(console: Console, report: dict[str, Any]) -> None:
    """What was written, and what to do with it."""
    for name in ("layer", "root_layer", "rrd", "video", "csv", "html"):
        if report[name]:
            say(console, f"wrote {report[name]}")
    figures = [Path(figure) for figure in report["figures"]]
    for folder in dict.fromkeys(figure.parent for figure in figures):
        names = ", ".join(figure.name for figure in figures if figure.parent == folder)
        say(console, f"wrote {names} in {folder}")
    if report["root_layer"]:
        shown_with = "the new curves" if is_optimized(report) else "the simulated motion"
        say(console, f"next: open {report['root_layer']}, which shows the shot with {shown_with}")
    if report["rrd"]:
        say(console, f"next: rerun {report['rrd']}")
    if is_still(report):
        say(console, "next: apply CalmFlexibleBodyAPI to links that bend")
    elif not is_optimized(report):
        command = f"calmotion optimize {shlex.quote(report['shot'])} -o LAYER"
        if shakes(report):
            say(console, f"next: {command} removes the shake")
        else:
            done = f"every error is below the accuracy of the simulation ({length(report['tolerance_m'])})"
            say(console, f"next: {done}; {command} --tolerance LENGTH, with a smaller length, removes more")
    if not any(report[name] for name in ("layer", "rrd", "video", "html")):
        say(console, "next: --html FILE shows the motion in a browser, --rrd FILE in the rerun viewer")


def print_warnings(console: Console, report: dict[str, Any]) -> None:
    """What may be otherwise than the user expects."""
    suffix = is_optimized(report)
    if suffix and report["resumed_iterations"]:
        say(
            console,
            f"resumed from the checkpoint of an interrupted run, after {report['resumed_iterations']} iterations",
        )
    if suffix and report["stopped"] not in ("converged", GOAL_REACHED, ""):
        gain, left = report["expected_further_gain_m"], max(t["max_error_after_m"] for t in report["targets"])
        # far from the limits, a step of the search promises more than there is
        more = f"; one more iteration may take away {about(gain)}" if gain is not None and gain < left else ""
        say(console, f"the search ended early: {report['stopped']}{more}")
    for path in report["still_targets"]:
        say(console, f"target {path} does not move, so that it shows no shake: choose a point of a link that moves")
    print_shares(console, report["error_shares"])
    print_lost_motion(console, report["lost_motion"], suffix)
    held = max(report["friction_band"], key=lambda row: row["max_error_m"], default=None)
    if held and held["max_error_m"] > FRICTION * report["tolerance_m"]:
        say(
            console,
            f"friction of motors may hold {held['path']} up to {about(held['max_error_m'])} away from its place at "
            "rest; the errors above do not include this, and no motor curve removes it",
        )
    print_limits(console, report["limits"], bool(suffix))
    print_terms(console, report["terms"])
    sags = {target["path"]: target[f"sag{suffix}_m"] or 0.0 for target in report["targets"]}
    hanging = max(sags, key=sags.__getitem__, default="")
    if hanging and sags[hanging] > 1e-6:
        say(console, f"gravity alone moves {hanging} by {about(sags[hanging])} at rest (sag)")
    seams = [target[f"seam{suffix}_m"] for target in report["targets"]]
    if seams and seams[0] is not None:
        say(console, f"largest distance of a target between start and end of a cycle: {length(max(seams))}")
        growth = report["loop_growth"]
        if growth is None or growth > 1.0:
            factor = "without bound" if growth is None else f"by a factor of {growth:.3g}"
            say(console, f"the cyclic motion is unstable: a disturbance grows {factor} in each cycle")
    if report["dead_centres_s"]:
        times = [f"{time:.3f}" for time in report["dead_centres_s"]]
        more = f" and {len(times) - 5} more times" if len(times) > 5 else ""
        say(console, f"closed chains pass a dead centre at {', '.join(times[:5])} s{more}")
    if report["refined_steps"]:
        say(console, f"{report['refined_steps']} steps were divided into smaller ones: try a smaller --step")
    print_joint_gap(console, report["max_joint_gap_m"])
    print_efforts(console, report["efforts"], report["step_s"])
    print_support(console, report["reactions"])
    print_contacts(console, report["contacts"])


def print_work(console: Console, report: dict[str, Any]) -> None:
    """The search and the steps: what the run cost."""
    if is_optimized(report):
        say(
            console,
            f"objective {report['objective_before']:.6g} -> {report['objective_after']:.6g} in {report['iterations']} "
            f"iterations, {report['forward_simulations']} simulations, {report['linearized_sweeps']} linearised "
            f"sweeps, {report['wall_s']:.2f} s",
        )
        kept = [motor["path"] for motor in report["motors"] if not motor["changed"]]
        if kept:
            say(console, f"motors without changes: {', '.join(kept)}")
    say(
        console,
        f"{report['steps']} steps of {1000 * report['step_s']:.4g} ms, {report['dof']} coordinates, "
        f"{report['modes']} of them elastic; {report['total_wall_s']:.1f} s in total"
        + (f", peak memory {report['peak_memory_gb']:.2f} GB" if report["peak_memory_gb"] else ""),
    )
    stages = [
        [row["operator"], f"{row['processor_s']:.1f} s", f"{row['peak_memory_gb'] or 0.0:.2f} GB"]
        for row in report["operators"]
        if row["processor_s"] >= SHORT_STAGE
    ]
    if stages:
        print_table(console, "Stages", ["operator", "processor time", "peak memory so far"], stages)
    for row in report["reactions"]:
        force, moment = f"{row['max_force_n']:.4g} N", f"{row['max_moment_n_m']:.4g} N m"
        say(console, f"largest load on the mount of {row['body']}: {force} and {moment}")


def _print_answer(report: dict[str, Any], console: Console) -> None:
    report, shortened = _with_short_paths(report)
    print_verdict(console, report)
    print_retiming(console, report["retime"])
    print_remaining(console, report)
    print_errors(console, report)
    print_robustness(console, report)
    if shortened:
        say(console, SHORTENED)


# The parts of the page of `--html` by their headings.
SECTIONS: Mapping[str, Callable[[dict[str, Any], Console], None]] = {
    "Result": _print_answer,
    "Limits and other causes": lambda report, console: print_warnings(console, report),
    "Accuracy of the simulation": lambda report, console: print_budget(console, report),
    "Simplifications": lambda report, console: print_left_out(console, report["left_out"]),
    "Notes on the shot": lambda report, console: print_notes(console, report["notes"]),
    "Work": lambda report, console: print_work(console, report),
}
