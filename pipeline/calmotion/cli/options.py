"""Options that several commands share."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from calmotion.cli.parser import SHARED
from calmotion.cli.retiming import retime_settings

if TYPE_CHECKING:
    from calmotion.cli.progress import ProgressDisplay
    from calmotion.workflow.shot import Shot

# Those of `calmotion.model.model_choice`, written out since `--help` does not import the engine; a test compares them.
MEANINGS = {
    "bodies": "rigid bodies in place of flexible ones",
    "turning": "no gyroscopic terms for non-rotating bodies",
    "loops": "no redundant constraints of closed chains",
    "modes": "fewer modes",
    "directions": "subspaces for nonlinear bodies and their quadratic strain",
    "elasticity": "linear elastic law",
    "motors": "no optimisation of motors without influence on the targets",
}
KINDS = tuple(MEANINGS)


def json_option(command: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
    """The option --json."""
    command.add_argument("--json", action="store_true", help="print one JSON object on stdout, and nothing else there")


def report_options(command: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
    """The options of a command that prints a report: --json and --quiet."""
    json_option(command)
    command.add_argument("--quiet", action="store_true", help="print nothing but errors (and the object of --json)")


def shot_arguments(command: argparse.ArgumentParser, optional: bool = False) -> None:
    """Add the options that all commands on a shot have.

    Args:
        optional: Whether other options may name shots in place of the argument.
    """
    command.add_argument("shot", metavar="SHOT", nargs="?" if optional else None, help="USD file of the shot")
    group = command.add_argument_group(SHARED)
    report_options(group)
    group.add_argument("--progress", action="store_true", help="print machine-readable progress to stderr")
    group.add_argument(
        "--openjd", action="store_true", help="print progress to stdout in the words of Open Job Description"
    )
    plugin_option(group)
    group.add_argument(
        "--run",
        metavar="OPERATOR",
        action="append",
        default=[],
        help="also run this operator of a plugin, such as speed_watch.report; may be repeated",
    )
    group.add_argument("--settings", metavar="FILE", help="TOML file with a table for each operator")
    group.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="set a property of an operator, such as fe.mesh.element_size=5mm; see `calmotion plugins list`",
    )


def html_option(command: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
    """Add `--html`."""
    command.add_argument(
        "--html",
        metavar="FILE",
        help="write one page for browsers, with the report, its curves and, for a motion, a 3D player; it needs no "
        "network",
    )


def motion_option(command: argparse.ArgumentParser) -> None:
    """Add `--motion`."""
    command.add_argument(
        "--motion",
        metavar="FILE",
        help="file with a motion for the motors, such as a BVH file (with --set bvh.read.map=...)",
    )


def tolerance_option(command: argparse.ArgumentParser) -> None:
    """Add `--tolerance`, of a command that simulates to the tolerance of the shot."""
    command.add_argument(
        "--tolerance",
        metavar="LENGTH",
        type=quantity("m", needs_unit=True, positive=True),
        help="accuracy of the simulation at the targets, with a unit (1mm; default: the tolerance of the shot)",
    )


def plugin_option(command: argparse.ArgumentParser | argparse._ArgumentGroup) -> None:
    """Add `--plugins`."""
    command.add_argument(
        "--plugins",
        metavar="DIR",
        action="append",
        default=[],
        help="folder with more plugins; may be repeated",
    )


def run_options(command: argparse.ArgumentParser) -> None:
    """Add the options of `simulate` and `optimize`: outputs, motion, verification."""
    outputs = command.add_argument_group("outputs")
    outputs.add_argument(
        "--bake",
        nargs="?",
        const="motors",
        choices=("motors", "simulated"),
        help="also write body transforms: those of a rigid robot with the new curves (motors, the default), or those "
        "of the predicted motion (simulated)",
    )
    outputs.add_argument(
        "--samples-per-second",
        metavar="HZ",
        type=quantity("Hz", positive=True),
        help="write more samples than the frames, for linear interpolation",
    )
    outputs.add_argument(
        "--splines",
        action="store_true",
        help="write motor curves as splines with the optimiser's knots, not as samples",
    )
    outputs.add_argument("--csv", metavar="FILE", help="write a table of targets and motors, one row for each step")
    outputs.add_argument("--rrd", metavar="FILE", help="write a recording for the rerun viewer")
    outputs.add_argument("--figures", metavar="DIR", help="draw figures into this folder")
    outputs.add_argument("--video", metavar="FILE", help="write a video (.webp, or .mp4 where ffmpeg is installed)")
    html_option(outputs)
    outputs.add_argument(
        "--manifest",
        metavar="FILE",
        help="write a manifest (JSON): inputs and outputs with hashes, versions, settings, verdict",
    )
    motion_option(command)
    command.add_argument(
        "--verbose", action="store_true", help="also print the search, the steps, the error budget and all notes"
    )
    command.add_argument(
        "--verify",
        action="store_true",
        help="measure the error of the result against a finer simulation (takes several times as long)",
    )
    command.add_argument(
        "--strict",
        action="store_true",
        help="exit with status 1 if the simulation does not keep the tolerance, curves leave a larger error than the "
        "animation or the goal, or a foot would not stay; the outputs are written all the same",
    )


def simulation_options(command: argparse.ArgumentParser, integrators: str) -> None:
    """Add the options of the simulation and of the simplification of the model."""
    model = command.add_argument_group("simulation")
    model.add_argument(
        "--step", metavar="TIME", type=quantity("s", positive=True), help="time step, in s or with a unit (2ms)"
    )
    model.add_argument(
        "--tolerance",
        metavar="LENGTH",
        type=quantity("m", needs_unit=True, positive=True),
        help="accuracy of the simulation at the targets, with a unit (1mm); time step, modes and simplifications "
        "follow from it (default: that of the shot, or a thousandth of the reach of the character)",
    )
    model.add_argument("--integrator", metavar="NAME", default=None, help=integrators)
    model.add_argument(
        "--pre-roll",
        metavar="TIME",
        type=quantity("s"),
        help="time before the first frame in which the robot eases into the motion (default: automatic)",
    )
    model.add_argument(
        "--motors",
        choices=("authored", "ideal"),
        default="authored",
        help="ideal: joints follow their curves exactly, whatever calm:motor:model says (default: authored)",
    )
    meanings = "; ".join(f"{kind}: {meaning}" for kind, meaning in MEANINGS.items())
    group = command.add_argument_group(
        "model simplification", f"By default the tolerance decides. Kinds: {meanings}; all: all of these."
    )
    for flag, text in (("--keep", "never make"), ("--leave-out", "always make")):
        group.add_argument(
            flag, metavar="KIND", action="append", default=[], choices=("all", *KINDS),
            help=f"{text} simplifications of this kind; may be repeated",
        )  # fmt: skip


def opened_shot(args: argparse.Namespace) -> Shot:
    """The shot that the arguments name, not yet read; plugins that could not be loaded are reported on stderr.

    Raises:
        SettingError: A folder holds no plugin, or the settings cannot be read.
    """
    from calmotion.cli.output import tell_failed_plugins
    from calmotion.workflow.shot import Shot

    shot = Shot(args.shot, getattr(args, "motion", None), args.plugins, args.settings)
    if not args.quiet:
        tell_failed_plugins(shot.host)
    return shot


def run_arguments(args: argparse.Namespace, display: ProgressDisplay) -> dict[str, Any]:
    """The keyword arguments of the workflow's functions that every command on a shot has.

    Raises:
        SettingError: An assignment of `--set` cannot be read.
    """
    return {
        "operators": args.run,
        "settings": assignments(args),
        "progress": display,
        "on_operator": display.done,
    }


def progress_display(args: argparse.Namespace, quiet: bool | None = None) -> ProgressDisplay:
    """What shows the progress of a command on a shot, as its options ask for it.

    Args:
        args: Of a command that `shot_command` made.
        quiet: Whether nothing is shown to a person; None: as `--quiet` says.
    """
    from calmotion.cli.progress import ProgressDisplay

    quiet = args.quiet if quiet is None else quiet
    return ProgressDisplay(quiet, args.progress, args.openjd, getattr(args, "verbose", False))


def simulation_arguments(args: argparse.Namespace) -> dict[str, Any]:
    """The keyword arguments of the workflow's functions that `simulation_options` added."""
    names = ("tolerance", "step", "integrator", "pre_roll", "motors", "keep", "leave_out")
    return {name: getattr(args, name) for name in names}


def assignments(args: argparse.Namespace) -> dict[str, dict[str, object]]:
    """The settings of `--set`, and those that have options of their own.

    Raises:
        SettingError: An assignment cannot be read.
    """
    from calmotion.host import merge, read_assignment

    names = {"bake": None, "samples_per_second": None, "splines": False}
    writer: dict[str, object] = {
        name: value for name, empty in names.items() if (value := getattr(args, name, empty)) != empty
    }
    searched = ("robust", "scenarios", "goal")
    search = {name: value for name in searched if (value := getattr(args, name, None)) is not None}
    search |= retime_settings(args)
    if getattr(args, "retime_scene", None) is not None:
        writer["retime_scene"] = args.retime_scene == "yes"
    own = {"usd.write": writer, "retarget.optimize": search}
    return merge([*(read_assignment(text) for text in args.set), {name: v for name, v in own.items() if v}])


def quantity(unit: str, needs_unit: bool = False, positive: bool = False) -> Callable[[str], float]:
    """The type of an argument that is a quantity in a unit, not negative."""

    def read(text: str) -> float:
        from calmotion.host import SettingError, has_no_unit, parse_quantity

        try:
            value = parse_quantity(text, unit)
            bare = needs_unit and has_no_unit(text)
        except SettingError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        plain = text.strip().removeprefix("-")
        wanted = f"{plain}{unit} or {plain}m{unit}" if bare else plain
        if value < 0.0:
            raise argparse.ArgumentTypeError(f"{text} is negative; write {wanted}")
        if value == float("inf") or (positive and not value and not bare):
            raise argparse.ArgumentTypeError(f"{text} is not {'finite' if value else 'above zero'}")
        if bare:
            raise argparse.ArgumentTypeError(f"{text} has no unit; write {wanted}")
        return value

    return read


def count_of(things: str) -> Callable[[str], int]:
    """The type of an argument that is a number of things, 1 or more."""

    def read(text: str) -> int:
        if not text.isdecimal() or int(text) < 1:
            raise argparse.ArgumentTypeError(f"{text} is not a number of {things}, 1 or more")
        return int(text)

    return read
