"""`calmotion warmup`: compile the kernels ahead of the first shot."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.options import Commands, json_option

if TYPE_CHECKING:
    from calmotion.cli.output import Output


def add_to(commands: Commands) -> None:
    """Add the command."""
    text = "compile the kernels ahead of the first shot"
    command = commands.add_parser("warmup", help=text, description=f"{text[0].upper()}{text[1:]}. Takes half a minute.")
    json_option(command)
    command.add_argument("--quiet", action="store_true", help="print no progress and no report")
    command.set_defaults(command=_run)


def _run(args: argparse.Namespace, output: Output) -> int:
    from dataclasses import asdict

    from calmotion.cli.progress import ProgressDisplay
    from calmotion.workflow.installation.warmup import warmup

    with ProgressDisplay(args.quiet) as display:
        made = warmup(display)
    if output.json:
        output.object(asdict(made))
    elif not args.quiet:
        did = f"compiled {made.compiled} kernels" if made.compiled else "nothing to compile"
        print(f"{did} in {made.wall_s:.1f} s; {made.kernels} are in {made.folder}", file=output.stream)
    return 0
