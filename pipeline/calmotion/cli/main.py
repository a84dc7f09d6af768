"""The command line: a thin layer over the host. Imports nothing heavy, so that `--help` comes at once."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from calmotion import ShotError, __version__

if TYPE_CHECKING:
    from calmotion.cli.output import Output

    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

BENCHMARKS = {
    "baselines": "optimizer.baselines", "gradients": "integrators.gradients", "integrators": "integrators.integrators",
    "meshing": "speed.meshing", "needs": "accuracy.simplification", "optimizer": "optimizer.optimizer",
    "reading": "speed.reading", "reduction": "speed.reduction", "scaling": "speed.scaling",
    "settling": "accuracy.reduction_convergence", "stability": "integrators.stability",
    "tolerances": "accuracy.tolerances", "work-precision": "accuracy.work_precision",
}  # fmt: skip
NEEDS = ("bodies", "turning", "loops", "modes", "directions", "elasticity", "motors", "ranges")  # those of `shot.needs`
DONE, FAILED, WRONG_USAGE, INTERRUPTED = 0, 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command.

    Args:
        arguments: Those after the program's name; of this process when None.

    Returns:
        0 done, 1 the shot cannot be processed, 2 wrong usage, 130 interrupted.
    """
    try:
        args = _parser().parse_args(arguments)
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else WRONG_USAGE
    from calmotion.cli.output import print_error, protected_stdout

    with protected_stdout(args.json) as output:
        try:
            return args.command(args, output)
        except ShotError as error:
            from calmotion.host import SettingError

            print_error(error, output)
            return WRONG_USAGE if isinstance(error, SettingError) else FAILED
        except KeyboardInterrupt:
            print_error(ShotError("interrupted"), output)
            return INTERRUPTED
        except BrokenPipeError:
            return FAILED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="calmotion",
        description="Retargets the animation of a flexible robotic character so that it does not shake.",
        epilog="Exit status: 0 done, 1 the shot cannot be processed, 2 wrong usage, 130 interrupted.",
    )
    parser.add_argument("--version", action="version", version=f"calmotion {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    inspect = _shot_command(commands, "inspect", _inspect, "what is in the shot, and what would be left out and why")
    inspect.add_argument(
        "--modes", metavar="DIR", help="folder for the mode shapes of the flexible bodies (.vtu, .png) and their table"
    )
    inspect.add_argument(
        "--strict",
        action="store_true",
        help="a gate before publishing: check everything that costs little, with USD's validators as well, list all "
        "that is found, and end with status 1 if that is anything",
    )
    simulate = _shot_command(commands, "simulate", _simulate, "simulate as animated")
    optimize = _shot_command(commands, "optimize", _optimize, "find motor curves that do not shake, and write them")
    simulate.add_argument("-o", "--output", metavar="LAYER", help="USD layer to write")
    optimize.add_argument("-o", "--output", metavar="LAYER", required=True, help="USD layer to write")
    simulate.add_argument(
        "--shaper", metavar="KIND", help="pass the tracks through zv, zvd, zv2, zvd2 or lowpass first, to compare with"
    )
    for command in (simulate, optimize):
        _run_options(command)
    for command in (inspect, simulate, optimize):
        _simulation_options(command)
        _needs_options(command)
    rig = _shot_command(commands, "rig", _rig, "make a robot of a skinned character: bodies, joints, motors, targets")
    rig.add_argument("-o", "--output", metavar="LAYER", required=True, help="USD layer to write; it opens the shot")
    bench = commands.add_parser(
        "bench",
        help="measure error against run time",
        description="Measure error against run time; `calmotion bench NAME --help` tells what each can vary.",
    )
    bench.add_argument("name", metavar="NAME", choices=BENCHMARKS, help=" or ".join(BENCHMARKS))
    bench.add_argument("arguments", nargs=argparse.REMAINDER, help="its own arguments")
    bench.set_defaults(command=_bench, json=False)
    _plugins_commands(commands)
    return parser


def _shot_command(commands: Commands, name: str, function: Callable[..., int], text: str) -> argparse.ArgumentParser:
    command = commands.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
    command.set_defaults(command=function)
    command.add_argument("shot", metavar="SHOT", help="USD file of the shot")
    command.add_argument("--json", action="store_true", help="print one JSON object on stdout, and nothing else there")
    command.add_argument("--quiet", action="store_true", help="print nothing but errors (and the object of --json)")
    command.add_argument(
        "--progress", action="store_true", help="tell progress on stderr in lines for a program (tabs between fields)"
    )
    _plugin_options(command)
    command.add_argument(
        "--run",
        metavar="OPERATOR",
        action="append",
        default=[],
        help="run this operator of a plugin as well, such as curves.export; may be repeated",
    )
    command.add_argument("--settings", metavar="FILE", help="TOML file with a table for each operator")
    command.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="set a property of an operator, such as fe.mesh.element_size=5mm; see `calmotion plugins list`",
    )
    return command


def _plugin_options(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--plugins", metavar="DIR", action="append", default=[], help="folder with more plugins; may be repeated"
    )


def _run_options(command: argparse.ArgumentParser) -> None:
    outputs = command.add_argument_group("outputs")
    outputs.add_argument(
        "--bake",
        nargs="?",
        const="motors",
        choices=("motors", "simulated"),
        help="write body transforms as well: of a rigid robot with the new curves, or of the predicted motion",
    )
    outputs.add_argument(
        "--samples-per-second", metavar="HZ", help="write denser samples than the frames, for linear interpolation"
    )
    outputs.add_argument(
        "--splines",
        action="store_true",
        help="write motor curves as splines with the optimiser's knots, not as samples",
    )
    outputs.add_argument("--csv", metavar="FILE", help="table of targets and motors, one row a time step")
    outputs.add_argument("--rrd", metavar="FILE", help="recording for the rerun viewer")
    outputs.add_argument("--figures", metavar="DIR", help="folder for figures")
    command.add_argument(
        "--motion",
        metavar="FILE",
        help="motion from beside the shot onto motors, such as a BVH file (--set bvh.read.map=...)",
    )
    command.add_argument(
        "--verify",
        action="store_true",
        help="measure the error of the result against a finer run: several times the time",
    )


def _simulation_options(command: argparse.ArgumentParser) -> None:
    model = command.add_argument_group("simulation")
    model.add_argument("--step", metavar="TIME", type=_quantity("s"), help="time step, in s or with a unit (2ms)")
    model.add_argument(
        "--tolerance",
        metavar="LENGTH",
        type=_quantity("m"),
        help="error at the targets that does not matter (1mm); the time step then follows from it",
    )
    model.add_argument(
        "--integrator",
        metavar="NAME",
        default=None,
        help="bdf2 (the only one for optimize), newmark, generalized-alpha, rk4 or radau (default: bdf2; "
        "generalized-alpha where simulate is given a tolerance, as it needs half the steps)",
    )
    model.add_argument(
        "--pre-roll", metavar="TIME", type=_quantity("s"), help="time that eases into the motion (default: automatic)"
    )


def _needs_options(command: argparse.ArgumentParser) -> None:
    group = command.add_argument_group("what a shot needs, otherwise decided by the tolerance")
    for flag, text in (("--keep", "do not leave out"), ("--leave-out", "leave out")):
        group.add_argument(
            flag, metavar="KIND", action="append", default=[], choices=("all", *NEEDS),
            help=f"{text} {', '.join(NEEDS[:-1])}, {NEEDS[-1]} or all; may be repeated",
        )  # fmt: skip


def _quantity(unit: str) -> Callable[[str], float]:
    def read(text: str) -> float:
        from calmotion.host import SettingError, parse_quantity

        try:
            value = parse_quantity(text, unit)
        except SettingError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        if not 0.0 <= value < float("inf"):
            raise argparse.ArgumentTypeError(f"{text} is out of range; it must be finite and not negative")
        return value

    return read


def _plugins_commands(commands: Commands) -> None:
    text = "list, check, disable and begin plugins"
    plugins = commands.add_parser("plugins", help=text, description=f"{text.capitalize()}.")
    actions = plugins.add_subparsers(title="commands", required=True, metavar="COMMAND")
    listing = actions.add_parser("list", help="every plugin, its state, its operators and their properties")
    listing.set_defaults(command=_list_plugins)
    _plugin_options(listing)
    listing.add_argument("--verbose", action="store_true", help="print the traceback of a plugin that failed")
    check = actions.add_parser("check", help="check that a plugin keeps to the rules")
    check.set_defaults(command=_check_plugin)
    check.add_argument("folder", metavar="DIR", help="folder of the plugin")
    choices = []
    for name, text in (("enable", "load a plugin again"), ("disable", "do not load a plugin any more")):
        choice = actions.add_parser(name, help=text)
        choice.set_defaults(command=_choose_plugin, enabled=name == "enable")
        choice.add_argument("id", metavar="ID", help="id of the plugin, as `calmotion plugins list` shows it")
        _plugin_options(choice)
        choices.append(choice)
    new = actions.add_parser("new", help="begin a plugin: a folder with an operator, a manifest and a passing test")
    new.set_defaults(command=_new_plugin)
    new.add_argument("name", metavar="NAME", help="id of the plugin: a-z, 0-9 and _")
    new.add_argument("--folder", metavar="DIR", default=".", help="where the folder NAME is made (default: here)")
    for command in (listing, check, *choices, new):
        command.add_argument("--json", action="store_true", help="print one JSON object on stdout")


def _inspect(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.inspect import inspect_shot

    return inspect_shot(args, output)


def _simulate(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.run import run_shot

    return run_shot(args, "simulate", output)


def _optimize(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.run import run_shot

    return run_shot(args, "optimize", output)


def _rig(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.rig import rig

    return rig(args, output)


def _bench(args: argparse.Namespace, output: Output) -> int:
    from importlib import import_module

    return import_module(f"calmotion.benchmarks.{BENCHMARKS[args.name]}").main(args.arguments)


def _list_plugins(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.plugins import list_plugins

    return list_plugins(args, output)


def _choose_plugin(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.plugins import choose_plugin

    return choose_plugin(args, output)


def _new_plugin(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.plugins import new_plugin

    return new_plugin(args, output)


def _check_plugin(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.plugins import check_plugins

    return check_plugins(args, output)


if __name__ == "__main__":
    sys.exit(main())
