"""Options of `simulate` and `optimize` that a command on many shots passes on to each of them."""

import argparse
import os
from collections.abc import Iterator

from calmotion.cli import plugin_option, quantity, simulation_options

EXTRAS = {
    "csv": "a table for each shot",
    "rrd": "a recording for the rerun viewer for each shot",
    "figures": "figures of each shot",
    "video": "a video of each shot",
}
_VALUES = (
    "tolerance",
    "step",
    "integrator",
    "pre_roll",
    "robust",
    "scenarios",
    "goal",
    "bake",
    "samples_per_second",
)
_OF_SEARCHES = ("robust", "scenarios", "goal", "retime")
_FLAGS = ("verify", "strict", "splines")
_LISTS = {"keep": "--keep", "leave_out": "--leave-out", "run": "--run", "set": "--set"}


def forwarded_options(command: argparse.ArgumentParser, tempo: bool = True) -> None:
    """Add the options that are passed on.

    Args:
        tempo: Whether each shot may have a tempo of its own.
    """
    group = command.add_argument_group("each shot", "As of `calmotion optimize`.")
    group.add_argument("--simulate", action="store_true", help="simulate the shots as animated, do not optimise them")
    for name, text in EXTRAS.items():
        group.add_argument(f"--{name}", action="store_true", help=text)
    group.add_argument("--verify", action="store_true", help="measure the error of each result by a finer simulation")
    group.add_argument(
        "--strict",
        action="store_true",
        help="a shot fails if its simulation misses the tolerance, or its curves leave a larger error",
    )
    group.add_argument("--robust", nargs="?", const="worst", choices=("worst", "mean"), help="robust curves")
    group.add_argument("--scenarios", metavar="N", help="number of robots of --robust")
    group.add_argument(
        "--goal",
        metavar="LENGTH",
        type=quantity("m", needs_unit=True, positive=True),
        help="error at the targets that is accepted after optimising, with a unit (2mm)",
    )
    command.set_defaults(retime=None)
    if tempo:
        group.add_argument(
            "--retime", metavar="slowest=2,fastest=1", nargs="?", const="", help="slower where motors cannot follow"
        )
    group.add_argument("--bake", nargs="?", const="motors", choices=("motors", "simulated"), help="body transforms")
    group.add_argument(
        "--samples-per-second", metavar="HZ", type=quantity("Hz", positive=True), help="more samples than the frames"
    )
    group.add_argument("--splines", action="store_true", help="curves as splines")
    group.add_argument("--run", metavar="OPERATOR", action="append", default=[], help="operator of a plugin to run")
    group.add_argument("--settings", metavar="FILE", help="TOML file with a table for each operator")
    group.add_argument("--set", metavar="NAME=VALUE", action="append", default=[], help="property of an operator")
    plugin_option(command)
    simulation_options(command, "as of simulate or optimize")


def command_of(args: argparse.Namespace) -> str:
    """`simulate` or `optimize`."""
    return "simulate" if args.simulate else "optimize"


def extras_of(args: argparse.Namespace) -> tuple[str, ...]:
    """The further outputs that are requested."""
    return tuple(name for name in EXTRAS if getattr(args, name))


def forwarded(args: argparse.Namespace) -> list[str]:
    """The options of each shot's command line; files by absolute paths.

    Raises:
        SettingError: An option of searches, for shots that are simulated alone.
    """
    from calmotion.host import SettingError

    given = [f"--{name.replace('_', '-')}" for name in _OF_SEARCHES if getattr(args, name) is not None]
    if given and command_of(args) == "simulate":
        raise SettingError(
            f"{given[0]} belongs to `calmotion optimize`", path="--simulate", remedy="Remove one of the two options."
        )
    return list(_forwarded(args))


def _forwarded(args: argparse.Namespace) -> Iterator[str]:
    for name in _VALUES:
        value = getattr(args, name)
        if value is None:
            continue
        text = f"{value!r}{_UNITS.get(name, '')}" if isinstance(value, float) else str(value)
        yield f"--{name.replace('_', '-')}={text}"
    yield from (f"--{name}" for name in _FLAGS if getattr(args, name))
    if args.retime is not None:
        yield f"--retime={args.retime}" if args.retime else "--retime"
    if args.motors != "authored":
        yield f"--motors={args.motors}"
    for name, option in _LISTS.items():
        for value in getattr(args, name):
            yield f"{option}={value}"
    if args.settings:
        yield f"--settings={os.path.abspath(args.settings)}"
    for folder in args.plugins:
        yield f"--plugins={os.path.abspath(folder)}"


_UNITS = {"tolerance": "m", "goal": "m", "step": "s", "pre_roll": "s"}  # of values that the parser has read
