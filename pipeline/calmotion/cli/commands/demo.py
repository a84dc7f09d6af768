"""`calmotion demo`: optimise the bartender sample, which every installation holds."""

import argparse
import shutil
from pathlib import Path

from calmotion.cli import Output, report_options
from calmotion.errors import file_access

EXAMPLES = (("calmotion demo", "after an installation"),)
SHOT = "bartender.usda"
# Each option with the plugin that writes it, which may have been deleted.
OPTIONAL = (
    ("--html", "bartender.html", "html_report"),
    ("--rrd", "bartender.rrd", "rerun_logger"),
    ("--figures", "figures", "figures"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.description = f"{command.description} Takes a minute the first time, since it compiles the kernels."
    command.add_argument(
        "-o", "--output", metavar="DIR", default="calmotion_demo", help="folder to write (default: %(default)s)"
    )
    report_options(command)


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.main import build_parser
    from calmotion.host.discovery import bundled_folder

    folder = Path(args.output)
    shot = folder / SHOT
    with file_access("the folder of the demo cannot be written", folder, "Name another with -o."):
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(_sample(), shot)
    arguments = ["optimize", str(shot), "-o", str(folder / "bartender_calm.usda")]
    arguments += ["--csv", str(folder / "bartender.csv")]
    for option, name, plugin in OPTIONAL:
        if (bundled_folder() / plugin).is_dir():
            arguments += [option, str(folder / name)]
    arguments += [option for option, given in (("--json", args.json), ("--quiet", args.quiet)) if given]
    chosen = build_parser("optimize").parse_args(arguments)
    status: int = chosen.command(chosen, output)
    return status


def _sample() -> Path:
    package = Path(__file__).resolve().parents[2]
    bundled = package / "bundled" / "samples" / SHOT
    return bundled if bundled.is_file() else package.parents[1] / "samples" / "bartender" / SHOT
