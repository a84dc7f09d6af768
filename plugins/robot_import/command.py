"""`calmotion import`: a shot from a robot's URDF, MJCF or USD file."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from calmotion.cli import Output, assignments, conclude, counted, notice, plugin_option, report_options, say

if TYPE_CHECKING:
    from rich.console import Console

EXAMPLES = (
    ("calmotion import arm.urdf --motion wave.csv -o shot.usda", "a shot of a robot and a motion"),
    ("calmotion import arm.urdf -o shot.usda --flexible '*forearm*=abs,3mm'", "with a link that bends"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.add_argument("robot", metavar="ROBOT", help=".urdf file, .xml file of MuJoCo, or USD file")
    command.add_argument("-o", "--output", metavar="LAYER", required=True, help="USD layer to write")
    command.add_argument(
        "--motion",
        metavar="FILE",
        help="motion of the joints: CSV (time_s, and a column for each joint in rad or m), NPZ, or BVH",
    )
    for flag, metavar, help_text in (
        ("--flexible", "PATTERN=MATERIAL[,WALL]", 'links that bend: "*forearm*=abs,3mm"; see `calmotion materials`'),
        ("--target", "PATTERN", "links or frames whose motion counts (default: the outermost points of the robot)"),
        ("--motors", "PATTERN", "joints that motors drive, or `all` (default: those that the file drives, else all)"),
        ("--package", "NAME=FOLDER", "folder of a ROS package that package:// names"),
    ):
        command.add_argument(flag, metavar=metavar, action="append", default=[], help=f"{help_text}; may be repeated")
    command.add_argument(
        "--solid", metavar="MATERIAL", help="material of the links without inertia, whose density gives their mass"
    )
    command.add_argument(
        "--materials",
        metavar="FILE",
        action="append",
        default=[],
        help="TOML file with more materials; may be repeated",
    )
    command.add_argument(
        "--converters",
        metavar="DIR",
        help="environment with urdf-usd-converter and mujoco-usd-converter (default: one that is made once)",
    )
    plugin_option(command)
    command.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="set a property of an operator, such as motion.read.angles=deg",
    )
    report_options(command)


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.host import SettingError

    from .robot import import_robot

    packages = dict(text.partition("=")[::2] for text in args.package)
    for name, folder in packages.items():
        if not name or not folder:
            raise SettingError(
                "a package is named as NAME=FOLDER",
                path="--package",
                found=f"{name}{folder}",
                remedy="Write for example my_robot=/home/me/my_robot.",
            )
    made = import_robot(
        args.robot, layer=args.output, motion=args.motion, flexible=args.flexible, targets=args.target,
        solid=args.solid, motors=args.motors, packages=packages, material_files=args.materials,
        converters=args.converters, plugins=args.plugins, settings=assignments(args),
        tell=(lambda text: None) if args.quiet else notice,
    )  # fmt: skip
    conclude(made.report(), (), output, None if args.quiet else _print)
    return 0


def _print(report: dict[str, Any], console: Console) -> None:
    besides = " besides links whose material gives their mass" if report["mass_of_material"] else ""
    say(
        console,
        f"{report['robot']}: {counted(report['bodies'], 'body').replace('bodys', 'bodies')}, "
        f"{len(report['flexible'])} of them flexible, {counted(len(report['motors']), 'motor')}, "
        f"{counted(len(report['targets']), 'target')}, {report['mass_kg']:.4g} kg{besides}",
    )
    if report["frames"] > 1:
        say(console, f"motion: {report['frames']} frames, {report['duration_s']:.4g} s")
    for path in report["flexible"]:
        say(console, f"flexible: {path}")
    for path in report["targets"]:
        say(console, f"target: {path}")
    for note in report["notes"]:
        say(console, f"note: {note}")
    beside = f", and {report['folder']} with the converted robot" if report["folder"] else ""
    say(console, f"wrote {report['layer']}{beside}")
    say(console, f"next: {_next(report)}")


def _next(report: dict[str, Any]) -> str:
    """What makes curves of the robot, or what it lacks for that."""
    import shlex

    layer = shlex.quote(str(report["layer"]))
    if report["frames"] < 2:
        return f"import again with --motion FILE, or animate the motors; calmotion inspect {layer} shows them"
    if not report["flexible"]:
        return (
            'import again with --flexible "PATTERN=MATERIAL" for links that bend, or give motors a compliant model; '
            f"calmotion inspect {layer} shows the gains that the robot's file has"
        )
    return f"calmotion inspect {layer} shows how stiff it is, calmotion optimize {layer} -o LAYER makes calm curves"
