"""The report of `calmotion inspect` as tables for a person."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterable
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from calmotion.cli.reports.limits import print_left_out, print_limits, print_tempo
from calmotion.cli.reports.run import print_notes
from calmotion.cli.reports.verdict import NOTHING_SHAKES
from calmotion.cli.tables import angle, counted, frequency, length, print_table, say
from calmotion.model.motor import DRIVE, ON_ERROR, ON_JOINT, PRESCRIBED, SERVO
from calmotion.model.outputs import ERROR, WARNING
from calmotion.model.result import EARLIER_MESH, SECTIONS
from calmotion.support.naming import grouped_notes, listed

if TYPE_CHECKING:
    from rich.console import Console

MODES = 5  # natural frequencies that are told by themselves
BODY_MODES, ROUGH_MODES = 6, 2  # those of a body, by its mesh and by its sections


def print_inspection(report: dict[str, Any], console: Console, verbose: bool = False) -> None:
    """Print the content of a shot, or the findings of a check.

    Args:
        verbose: Whether all simplifications are printed, and all natural frequencies.
    """
    if "findings" in report:
        _print_findings(console, report)
    else:
        _print_contents(console, report, verbose)


def _print_findings(console: Console, report: dict[str, Any]) -> None:
    for finding in report["findings"]:
        place = ".".join(filter(None, (finding["path"], finding["attribute"])))
        say(console, f"{finding['level']}: {place}")
        for label in ("problem", "found", "remedy", "rule"):
            if finding[label]:
                say(console, f"  {label}: {finding[label]}")
    levels = [finding["level"] for finding in report["findings"]]
    counts = ", ".join(counted(levels.count(level), level) for level in (ERROR, WARNING))
    say(console, f"{report['shot']}: {counts if levels else 'no findings'}")


def _print_contents(console: Console, report: dict[str, Any], verbose: bool) -> None:
    units = report["units"]
    frames = counted(report["frames"], "frame")
    say(console, f"{report['shot']}: {report['character']}, {frames}, {report['duration_s']:.4g} s")
    _print_answer(console, report)
    gravity = ", ".join(f"{component:.4g}" for component in report["gravity_m_s2"])
    gravity = f"gravity ({gravity}) m/s²" if any(report["gravity_m_s2"]) else "no gravity"
    say(
        console,
        f"units: {units['meters_per_unit']:g} m, {units['kilograms_per_unit']:g} kg, {units['up_axis']} up, "
        f"{units['time_codes_per_second']:g} time codes and {units['frames_per_second']:g} frames a second; {gravity}",
    )
    for layer in report["earlier_layers"]:
        say(console, f"contains an optimised layer: {layer}")
    bodies = [_body_row(body) for body in report["bodies"]]
    print_table(console, "Bodies", ["body", "kind", "mass", "elements", "frequencies"], bodies, texts=2)
    solids = [_solid_row(body) for body in report["bodies"] if "solid" in body]
    print_table(console, "Solids of flexible bodies", ["body", "made of", "volume", "frequency error"], solids, texts=2)
    notes = (f"{body['path']}: {note}" for body in report["bodies"] for note in body.get("solid_notes", ()))
    for note in grouped_notes(notes):
        say(console, note)
    _print_sources(console, report)
    print_table(
        console,
        "Joints",
        ["joint", "kind", "body 0", "body 1"],
        [[j["path"], j["kind"], j["body0"] or "world", j["body1"] or "world"] for j in report["joints"]],
        texts=4,
    )
    print_table(
        console,
        "Motors",
        ["motor", "track", "limits", "peak speed", "speed limit", "effort limit", "may change"],
        [_motor_row(motor) for motor in report["motors"]],
    )
    print_table(
        console,
        "Targets",
        ["target", "body", "position weight", "rotation weight"],
        [[t["path"], t["body"], f"{t['position_weight']:g}", f"{t['rotation_weight']:g}"] for t in report["targets"]],
        texts=2,
    )
    if report["system_frequencies_hz"]:
        modes = list(zip(report["system_frequencies_hz"], report["system_damping_ratios"], strict=True))
        rough = any(body.get("frequencies_from") == SECTIONS for body in report["bodies"])
        about = "about " if rough else ""
        shown = about + ", ".join(
            f"{frequency(hertz)} Hz ({ratio:.2g})" for hertz, ratio in modes[: None if verbose else MODES]
        )
        say(console, f"natural frequencies of the character in its first pose (damping ratios): {shown}, ...")
    print_limits(console, report["limits"], False)
    print_tempo(console, report["tempo"])
    _print_gains(console, report)
    print_left_out(console, report["left_out"], verbose)
    if report["figures"]:
        say(console, f"figures: {', '.join(report['figures'])}")
    if report["mode_shapes"]:
        say(console, f"mode shapes: {', '.join(report['mode_shapes'])}")
    print_notes(console, report["notes"])


def _print_answer(console: Console, report: dict[str, Any]) -> None:
    """What there is, what an optimisation would take, and the next command."""
    bodies, motors = report["bodies"], report["motors"]
    flexible = sum(body["simulated"] == "flexible" for body in bodies)
    fixed = sum(not motor["optimize"] for motor in motors)
    held = f" ({fixed} of them must not change)" if fixed else ""
    parts = [f"{len(bodies)} {'body' if len(bodies) == 1 else 'bodies'} ({flexible} flexible)"]
    parts += [counted(len(report["joints"]), "joint"), counted(len(motors), "motor") + held]
    say(console, f"{', '.join(parts)} and {counted(len(report['targets']), 'target')}")
    if not flexible and all(motor["model"] == PRESCRIBED for motor in motors):
        say(console, NOTHING_SHAKES)
        say(
            console,
            "next: apply CalmFlexibleBodyAPI to links that bend, and CalmTargetAPI to what should stay calm",
        )
        return
    say(console, _expected(report["expected"]))
    say(console, f"next: calmotion simulate {shlex.quote(report['shot'])} shows how much it shakes")


def _print_sources(console: Console, report: dict[str, Any]) -> None:
    """What frequencies are rough, and what others come from."""
    sources = [body.get("frequencies_from") for body in report["bodies"]]
    if SECTIONS in sources:
        say(
            console,
            "Frequencies marked `about`, and all that follows from them, are estimated from beams and sections: right "
            "within a factor of two for 9 of 10 links. --meshes computes them to about 1%, which may take minutes.",
        )
    earlier = sources.count(EARLIER_MESH)
    if earlier:
        say(console, f"flexible bodies with a mesh from an earlier run: {earlier}")


def _expected(row: dict[str, Any]) -> str:
    """What `optimize` is expected to take, as a sentence."""
    from rich.filesize import decimal

    from calmotion.tolerance.cost import readable_hours

    time, size = readable_hours(row["hours"]), decimal(round(1e9 * row["memory_gb"]))
    about = "" if time.startswith("less") else "about "
    return f"optimize is expected to take {about}{time} of processor time, and {size} of memory for the search"


def _print_gains(console: Console, report: dict[str, Any]) -> None:
    """Gains of the motors, and what they would do to the animation."""
    rows = _alike(_gain_row(motor) for motor in report["motors"] if motor["gains_from"])
    heads = ["motor", "model", "read from", "position gain", "velocity gain"]
    print_table(console, "Gains of motors", heads, rows, texts=3)
    for kind, what in _DAMPING.items():
        own = [m for m in report["motors"] if m["gains_from"] and m["damping_on"] == kind and _gains(m)[1]]
        if own:
            gains = f"The velocity gain of {counted(len(own), 'motor')}"
            say(console, f"{gains} acts on {what} (calm:motor:dampingOn: {kind}).")
    servos = _alike(_servo_row(motor) for motor in report["motors"] if motor["rotor"])
    heads = ["servo", "type", "armature", "gear", "friction", "viscous", "no-load speed", "delay", "backlash"]
    print_table(console, "Servos", heads, servos, texts=2)
    for motor in report["motors"]:
        if motor["coupled_to"]:
            other = f"{motor['coupled_to']}, by {motor['coupling']:g} of its angle"
            say(console, f"The motor of {motor['path']} also turns with {other}.")
    effects = report["effects_of_gains"]
    if effects:
        ideal = all(motor["model"] == PRESCRIBED for motor in report["motors"])
        lag, rest = (max(effects, key=itemgetter(key)) for key in ("max_error_m", "sag_m"))
        model = SERVO if servos else DRIVE
        remedy = f" This shot has ideal motors: set calm:motor:model to {model} to simulate the gains." if ideal else ""
        say(
            console,
            f"With these gains, the largest error as animated is about {length(lag['max_error_m'])} at {lag['path']} "
            f"(with ideal motors {length(lag['ideal_max_error_m'])}). At rest, {rest['path']} sags by "
            f"{length(rest['sag_m'])} (with ideal motors {length(rest['ideal_sag_m'])}).{remedy}",
        )


def _alike(rows: Iterable[list[str]]) -> list[list[str]]:
    """The rows of a table, those that differ in their motor alone as one."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for path, *cells in rows:
        groups.setdefault(tuple(cells), []).append(path)
    return [[listed(paths), *cells] for cells, paths in groups.items()]


_DAMPING = {
    ON_JOINT: "the speed of the joint itself, so that commands have to run ahead of the motion",
    ON_ERROR: "the difference of the command's speed and the joint's",
}


def _gains(motor: dict[str, Any]) -> tuple[float, float]:
    newtons, unit = ("n", "m") if "min_m" in motor else ("n_m", "rad")
    return motor[f"position_gain_{newtons}_{unit}"], motor[f"velocity_gain_{newtons}_s_{unit}"]


def _gain_row(motor: dict[str, Any]) -> list[str]:
    (position, velocity), linear = _gains(motor), "min_m" in motor
    shown, per = ("N/m", "N s/m") if linear else ("N m/rad", "N m s/rad")
    source = f"calm:motor:type {motor['type']}" if motor["type"] else re.sub(r" of /[^(]*", " ", motor["gains_from"])
    return [motor["path"], motor["model"], source, f"{position:.4g} {shown}", f"{velocity:.4g} {per}"]


def _servo_row(motor: dict[str, Any]) -> list[str]:
    rotor, linear = motor["rotor"], "min_m" in motor
    newtons, unit, effort = ("n", "m", "N") if linear else ("n_m", "rad", "N m")
    inertia = f"{rotor['armature_kg']:.4g} kg" if linear else f"{rotor['armature_kg_m2']:.4g} kg m²"
    gear, speed = rotor[f"gear_stiffness_{newtons}_{unit}"], rotor[f"no_load_speed_{unit}_s"]  # None: infinite
    return [
        motor["path"],
        motor["type"] or "-",
        inertia,
        "rigid" if gear is None else f"{gear:.4g} {effort}/{unit}",
        f"{rotor[f'friction_{newtons}']:.4g} {effort}",
        f"{rotor[f'viscous_friction_{newtons}_s_{unit}']:.4g} {effort} s/{unit}",
        "-" if speed is None else f"{(length if linear else angle)(speed)}/s",
        f"{1e3 * motor['delay_s']:.4g} ms",
        (length if linear else angle)(motor[f"backlash_{unit}"]) if motor[f"backlash_{unit}"] else "-",
    ]


def _body_row(body: dict[str, Any]) -> list[str]:
    frequencies = [frequency(value) for value in body.get("frequencies_hz", ())]
    rough = body.get("frequencies_from") == SECTIONS
    most = ROUGH_MODES if rough else BODY_MODES
    shown = ", ".join(frequencies[:most]) + (", ..." if len(frequencies) > most else "")
    if rough:
        shown = f"about {shown}"
    return [
        body["path"],
        body["kind"] if body["kind"] == body["simulated"] else f"{body['kind']}, simulated as {body['simulated']}",
        "-" if body["mass_kg"] is None else f"{body['mass_kg']:.4g} kg",
        str(body.get("elements") or "-"),
        f"{shown} Hz" if shown else "-",
    ]


def _solid_row(body: dict[str, Any]) -> list[str]:
    error = body["frequency_error"]
    return [
        body["path"],
        body["solid"],
        f"{1e6 * body['volume_m3']:.4g} cm³",
        "-" if error is None else f"{100.0 * error:.2g}%",
    ]


def _motor_row(motor: dict[str, Any]) -> list[str]:
    linear = "min_m" in motor
    shown, unit = (length, "m") if linear else (angle, "rad")
    effort, newtons = (motor["max_force_n"], "N") if linear else (motor["max_torque_n_m"], "N m")
    speed = motor[f"max_velocity_{unit}_s"]  # None where there is no limit
    lower, upper = shown(motor[f"lower_{unit}"]), shown(motor[f"upper_{unit}"])
    return [
        motor["path"],
        f"{shown(motor[f'min_{unit}'])} .. {shown(motor[f'max_{unit}'])}",
        "-" if motor[f"lower_{unit}"] is None is motor[f"upper_{unit}"] else f"{lower} .. {upper}",
        f"{shown(motor[f'peak_velocity_{unit}_s'])}/s",
        "-" if speed is None else f"{shown(speed)}/s",
        "-" if effort is None else f"{effort:.4g} {newtons}",
        "yes" if motor["optimize"] else "no",
    ]
