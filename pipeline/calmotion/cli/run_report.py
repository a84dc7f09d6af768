"""The report of `simulate` and `optimize` for a person."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TextIO

from rich.console import Console

from calmotion.cli.quantities import angle, length
from calmotion.cli.sentences import unbroken
from calmotion.cli.tables import console_on, print_table, say
from calmotion.shot.budget import CHOICES, MEASURED, MESH, REDUCTION, STEP, SUBSPACE

# What helps where an entry of the error budget is too large.
_SENSITIVE = "With large deflections, or near buckling, small errors grow: use a stiffer robot or a slower motion."
REMEDIES = {
    MESH: "Use smaller elements: calm:flexible:elementSize of the body, or --set fe.mesh.element_size=LENGTH.",
    STEP: f"Use a shorter --step, or none. {_SENSITIVE}",
    REDUCTION: f"Remove calm:flexible:modeCount and calm:flexible:elasticity, or use a larger tolerance. {_SENSITIVE}",
    SUBSPACE: f"Use --keep directions. {_SENSITIVE}",
    CHOICES: "Use --keep all.",
    MEASURED: _SENSITIVE,
}


def print_left_out(console: Console, rows: Sequence[dict[str, Any]]) -> None:
    """The simplifications, each with its reason and estimated error."""
    for row in rows:
        error = row["estimated_error_m"]
        cost = "" if error is None else f"; estimated error {length(error)}"
        say(console, f"simplified: {row['what']} ({row['why']}){cost}")


def print_notes(console: Console, notes: Sequence[str]) -> None:
    """The notes of the reader in a file; on a terminal they were printed when the shot was read."""
    for note in () if console.is_terminal else notes:
        say(console, f"note: {note}")


def print_limits(console: Console, limits: Sequence[dict[str, Any]], optimized: bool) -> None:
    """Limits of motors that are exceeded, or that keep the targets from their motion."""
    rows = []
    for row in limits:
        if not row["exceeded"] and row["cost_m"] is None:
            continue
        limit, before, after = row["shown"]
        verdict = "exceeded" if row["exceeded"] else f"costs {length(row['cost_m'])} rms"
        values = [limit, before, after] if optimized else [limit, after]
        rows.append([row["path"], row["quantity"], *values, f"{row['time_s']:.3f} s", verdict])
    heads = ["limit", "before", "after"] if optimized else ["limit", "reached"]
    print_table(console, "Active limits of motors", ["motor", "quantity", *heads, "at", ""], rows, texts=2)


def print_joint_gap(console: Console, gap: float) -> None:
    """The largest gap of a joint [m], where joints are not closed."""
    from calmotion.accuracy.step_error import CLOSED_GAP  # loads what has simulated before

    if gap > CLOSED_GAP:
        say(console, f"joints come apart by up to {length(gap)}")


def print_accuracy(console: Console, report: dict[str, Any]) -> None:
    """The error budget of the simulation itself, and whether it keeps the tolerance."""
    rows = [
        [entry["source"], length(entry["allowed_m"]), _length_or_unknown(entry["estimated_m"])]
        for entry in report["error_budget"]
    ]
    print_table(console, "Error budget", ["source", "allowed", "estimated"], rows)
    if report["verified_error_m"] is not None:
        say(
            console,
            f"measured simulation error {length(report['verified_error_m'])}, against a run with steps of "
            f"{1000 * report['verified_step_s']:.4g} ms and {report['verified_modes']} elastic coordinates",
        )
    tolerance = length(report["tolerance_m"])
    if report["tolerance_kept"]:
        say(console, f"the simulation keeps the tolerance of {tolerance}: error {length(report['simulation_error_m'])}")
    elif report["simulation_error_m"] is None:
        say(console, f"the error of the simulation was not estimated; the tolerance is {tolerance}")
    else:
        source = report["tolerance_missed_by"]
        say(
            console,
            f"the simulation does not keep the tolerance of {tolerance}: error {length(report['simulation_error_m'])}, "
            f"mostly of the {source}. {REMEDIES[source]}",
        )


def _length_or_unknown(metres: float | None) -> str:
    return "unknown" if metres is None else length(metres)


def print_run(report: dict[str, Any], stream: TextIO) -> None:
    """The report of `simulate` or `optimize`."""
    console = console_on(stream)
    optimized = "objective_after" in report
    suffixes = ["_before", "_after"] if optimized else [""]
    heads = [f"{kind}{' ' + s[1:] if s else ''}" for kind in ("max", "rms") for s in suffixes]
    for title, unit, shown in (("Position", "m", length), ("Rotation", "rad", angle)):
        name = "error" if unit == "m" else "rotation_error"
        keys = [f"{kind}_{name}{suffix}_{unit}" for kind in ("max", "rms") for suffix in suffixes]
        rows = [[target["path"], *(shown(target[key]) for key in keys)] for target in report["targets"]]
        print_table(console, f"{title} error of the targets", ["target", *heads], rows)
    if optimized:
        say(
            console,
            f"objective {report['objective_before']:.6g} -> {report['objective_after']:.6g} in {report['iterations']} "
            f"iterations, {report['forward_simulations']} simulations, {report['linearized_sweeps']} linearised "
            f"sweeps, {report['wall_s']:.2f} s",
        )
        if report["resumed_iterations"]:
            say(
                console,
                f"resumed from the checkpoint of an interrupted run, after {report['resumed_iterations']} iterations",
            )
        if report["stopped"] not in ("converged", ""):
            gain = report["expected_further_gain_m"]
            more = "" if gain is None else f", {length(gain)} expected gain of one more iteration"
            say(console, f"stopped: {report['stopped']}{more}")
        kept = [motor["path"] for motor in report["motors"] if not motor["changed"]]
        if kept:
            say(console, f"motors without changes: {', '.join(kept)}")
    if report.get("shaper"):
        say(
            console,
            f"{report['shaper']} delays the motion by {report['shaper_delay_s']:.3f} s; largest error from the "
            f"intended motion with that delay: {length(report['delayed_max_error_m'])}",
        )
    print_limits(console, report["limits"], optimized)
    sag = max((target[f"sag{suffixes[-1]}_m"] or 0.0 for target in report["targets"]), default=0.0)
    if sag > 1e-6:
        say(console, f"largest sag of a target at rest: {length(sag)}")
    seams = [target[f"seam{suffixes[-1]}_m"] for target in report["targets"]]
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
    say(
        console,
        f"{report['steps']} steps of {1000 * report['step_s']:.4g} ms, {report['dof']} coordinates, "
        f"{report['modes']} of them elastic; {report['total_wall_s']:.1f} s in total"
        + (f", peak memory {report['peak_memory_gb']:.2f} GB" if report["peak_memory_gb"] else ""),
    )
    print_joint_gap(console, report["max_joint_gap_m"])
    print_accuracy(console, report)
    print_left_out(console, report["left_out"])
    print_notes(console, report["notes"])
    for name in ("layer", "root_layer", "rrd", "csv"):
        if report[name]:
            say(console, f"wrote {unbroken(report[name])}")
    for figure in report["figures"]:
        say(console, f"wrote {unbroken(figure)}")
