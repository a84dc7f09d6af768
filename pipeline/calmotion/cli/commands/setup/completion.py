"""`calmotion completion`: a script that makes a shell complete commands, options and files."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.options import Commands

if TYPE_CHECKING:
    from calmotion.cli.output import Output

SHELLS = ("bash", "fish", "tcsh", "zsh")


def add_to(commands: Commands) -> None:
    """Add the command."""
    command = commands.add_parser(
        "completion",
        help="print a completion script for a shell",
        description='Print a completion script for a shell. For bash: eval "$(calmotion completion bash)".',
    )
    command.add_argument("shell", choices=SHELLS, help="the shell")
    command.set_defaults(command=_run, json=False)


def _run(args: argparse.Namespace, output: Output) -> int:
    import shtab

    print(shtab.complete(args.parser, args.shell), file=output.stream)
    return 0
