"""`calmotion calibrate`: the parameters of the robot from recordings of its performance."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from calmotion.cli import (
    Output,
    conclude,
    counted,
    html_option,
    measured,
    motion_option,
    opened_shot,
    page_of_report,
    print_table,
    progress_display,
    quantity,
    quantity_in,
    run_arguments,
    say,
    shot_arguments,
    tolerance_option,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import Console

EXAMPLES = (
    ("calmotion calibrate shot.usda --recording take.csv -o robot.usda", "markers, encoders"),
    ("calmotion calibrate shot.usda --recording a.csv --parameters modulus damping", "these alone"),
    ("calmotion calibrate --shot a.usda --recording a.csv --shot b.usda --recording b.csv -o robot.usda", "two shots"),
)


class _Named(argparse.Action):
    """Keeps `--shot` and `--recording` in their order: each recording is of the shot named before it."""

    def __call__(
        self, parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        performed = [*(getattr(namespace, "performed", None) or ())]
        if self.dest == "of_shot":
            performed.append((values, ()))
        else:
            shot, files = performed.pop() if performed else (None, ())
            performed.append((shot, (*files, values)))
        namespace.performed = performed


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command, optional=True)
    command.add_argument(
        "--shot",
        dest="of_shot",
        metavar="FILE",
        action=_Named,
        help="a shot of the robot, in place of SHOT; the recordings that follow are of it. May be repeated: the robot "
        "is the same, and gains may differ from shot to shot by known factors",
    )
    command.add_argument(
        "--recording",
        metavar="FILE",
        action=_Named,
        required=True,
        help="what was recorded: a table with columns named after prims or with a TOML map beside it, a C3D file, or a "
        "bag of ROS (of a single sensor as FILE@/PRIM); may be repeated",
    )
    command.add_argument("-o", "--output", metavar="LAYER", help="USD layer to write")
    command.add_argument(
        "--parameters",
        metavar="KIND",
        nargs="+",
        help="what to estimate: modulus, damping, density, mass, centre, position_gain, velocity_gain, gear_stiffness, "
        "armature, friction, viscous_friction, load_friction, max_torque, delay, encoder_offset, each also as "
        "KIND:PATTERN for some prim paths "
        "(default: all but density, centre and encoder_offset)",
    )
    prior_option(command)
    command.add_argument(
        "--no-validation", action="store_true", help="fit all samples; by default every fifth part is held out"
    )
    command.add_argument(
        "--step",
        metavar="TIME",
        type=quantity("s", positive=True),
        help="first time step, in s or with a unit (2ms); it is halved until the estimates do not depend on it",
    )
    tolerance_option(command)
    command.add_argument("--integrator", metavar="NAME", help="bdf2, newmark or generalized-alpha (the default)")
    command.add_argument("--figures", metavar="DIR", help="draw measured and simulated signals into this folder")
    html_option(command)
    motion_option(command)


def prior_option(command: argparse.ArgumentParser) -> None:
    """Add `--prior` and `--by-motor-type`."""
    command.add_argument(
        "--prior", metavar="KIND=VALUE", action="append", default=[], type=_prior,
        help="standard deviation of a parameter before the recording, relative (modulus=0.3) or in SI "
        "(delay=0.005, bias=0.3, place=0.002, clock_drift=1e-4); may be repeated",
    )  # fmt: skip
    command.add_argument(
        "--by-motor-type",
        action="store_true",
        help="motors of one type (calm:motor:type) share their gains, friction, armature, gear and delay",
    )


def _prior(text: str) -> tuple[str, float]:
    kind, _, value = text.partition("=")
    try:
        return kind, float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is not KIND=VALUE, such as modulus=0.3") from None


def parameter_arguments(args: argparse.Namespace) -> dict[str, Any]:
    """What is estimated, as `calibrate`, `excite` and `refine` take it."""
    from ..model.kinds import DEFAULT

    return {
        "parameters": args.parameters or DEFAULT,
        "priors": dict(args.prior),
        "by_motor_type": args.by_motor_type,
    }


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.workflow import prepare_page, with_shot

    from ..drawing import plots_of
    from ..workflow.calibrate import calibrate

    performed = _performed(args)
    shots = []
    for name, _ in performed:
        args.shot = with_shot(name)
        shots.append(opened_shot(args))
    inputs = {}
    for k, (shot, (_, files)) in enumerate(zip(shots, performed, strict=True), start=1):
        inputs[f"shot {k}"] = shot.path
        inputs |= {f"recording {k}.{n}": name.partition("@")[0] for n, name in enumerate(files, start=1)}
    if args.html:
        prepare_page(shots[0].host, args.html, inputs)
    with progress_display(args) as display:
        (shot, files), *others = zip(shots, (files for _, files in performed), strict=True)
        made = calibrate(
            shot, files, others=others, layer=args.output,
            **parameter_arguments(args), validate=not args.no_validation, tolerance=args.tolerance, step=args.step,
            integrator=args.integrator, figures=args.figures, **run_arguments(args, display),
        )  # fmt: skip
    report = made.report()
    plots = [(heading, figure) for _, heading, figure in plots_of(made.calibration)] if args.html else []
    report["html"] = page_of_report(shots[0].host, args.html, report, SECTIONS, inputs, plots)
    conclude(report, (), output, None if args.quiet else _print)
    return 130 if made.calibration.interrupted else 0


def _performed(args: argparse.Namespace) -> list[tuple[str, tuple[str, ...]]]:
    """Shots with their recordings, as SHOT or `--shot` name them.

    Raises:
        SettingError: Both do, none does, or a shot has no recording.
    """
    from calmotion.host import SettingError

    named = args.performed
    if args.shot is not None and named[0][0] is not None:
        raise SettingError(
            "a shot is named twice", path="--shot", found=args.shot, remedy="Name all shots with --shot, or one as SHOT"
        )
    if args.shot is None and named[0][0] is None:
        raise SettingError(
            "no shot is named for a recording",
            path="--recording",
            found=named[0][1][0],
            remedy="Name the shot as SHOT, or before its recordings with --shot",
        )
    found = [(args.shot if name is None else name, files) for name, files in named]
    for name, files in found:
        if not files:
            raise SettingError(
                "the shot has no recording", path="--shot", found=name, remedy="Name it behind it with --recording"
            )
    return found


def _went(row: dict[str, Any]) -> str:
    return "falls" if row["rms"] < row["rms_before"] else "goes"


def _print_answer(report: dict[str, Any], console: Console) -> None:
    of_robot = [row for row in report["parameters"] if row["of_robot"]]
    told = sum(bool(row["identifiable"]) for row in of_robot)
    say(console, f"The recordings identify {told} of {counted(len(of_robot), 'parameter')} of the robot.")
    for row in report["channels"]:
        held_out = row["validation_rms"]
        before, after, noise = (quantity_in(row[name], row["unit"], 3) for name in ("rms_before", "rms", "noise"))
        checked = (
            "" if held_out is None else f", {quantity_in(held_out, row['unit'], 3)} in samples that were not fitted"
        )
        say(
            console,
            f"{row['name']}: the difference between recording and simulation {_went(row)} from {before} to {after}"
            f"{checked} (root mean square; noise {noise}).",
        )
    _print_parameters(console, "Parameters of the robot", of_robot)
    for row in report["parameters"]:
        if row["advice"]:
            say(console, f"{row['name']} is not identifiable from these recordings: {row['advice']}")


def _print_files(report: dict[str, Any], console: Console) -> None:
    for file in (report["layer"], report["root"], *report["figures"], report["html"]):
        if file:
            say(console, f"wrote {file}")
    if report["root"]:
        say(console, f"next: calmotion optimize {report['root']} -o LAYER makes curves for this robot")


def _print_measurement(report: dict[str, Any], console: Console) -> None:
    for note in report["notes"]:
        say(console, f"note: {note}")
    measurement = [row for row in report["parameters"] if not row["of_robot"]]
    _print_parameters(console, "Parameters of the model and the measurement", measurement)
    say(
        console,
        f"{report['simulations']} simulations in {report['wall_s']:.3g} s; steps of {1e3 * report['step_s']:.3g} ms, "
        f"whose error is {report['step_shift']:.2g} standard deviations of the estimates",
    )


SECTIONS = {"Result": _print_answer, "Measurement": _print_measurement}


def _print(report: dict[str, Any], console: Console) -> None:
    _print_answer(report, console)
    _print_files(report, console)
    _print_measurement(report, console)


def _print_parameters(console: Console, title: str, parameters: Sequence[dict[str, Any]]) -> None:
    """A table of parameters; nothing without any."""

    rows = []
    for row in parameters:
        value, deviation = measured(row["value"], row["standard_deviation"], row["unit"])
        rows.append([
            row["kind"], row["name"].partition(" ")[2], quantity_in(row["prior"]["value"], row["unit"]), value,
            deviation + _share(row), _told(row["identifiable"]),
        ])  # fmt: skip
    heads = ["parameter", "of", "in the shot", "estimated", "standard deviation", "identifiable"]
    print_table(console, title, heads, rows, texts=2)


def _told(identifiable: bool | str) -> str:
    return identifiable if isinstance(identifiable, str) else "yes" if identifiable else "no"


def _share(row: dict[str, Any]) -> str:
    """The standard deviation as a share of the value; not of offsets, whose zero is free."""
    share = abs(row["standard_deviation"] / row["value"]) if row["value"] else float("inf")
    return f" ({100.0 * share:.2g}%)" if row["of_robot"] and row["prior"]["value"] and share < 1.0 else ""
