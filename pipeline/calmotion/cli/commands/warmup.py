"""`calmotion warmup`: compile the kernels ahead of the first shot."""

import argparse

from calmotion.cli import Output, json_option

EXAMPLES = (("calmotion warmup", "after an installation or an update"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.description = f"{command.description} Takes half a minute."
    json_option(command)
    command.add_argument("--quiet", action="store_true", help="print no progress and no report")


def run(args: argparse.Namespace, output: Output) -> int:
    from dataclasses import asdict

    from calmotion.cli.progress import ProgressDisplay
    from calmotion.workflow.warmup import warmup

    with ProgressDisplay(args.quiet) as display:
        made = warmup(display)
    if output.json:
        output.object(asdict(made))
    elif not args.quiet:
        did = f"compiled {made.compiled} kernels" if made.compiled else "nothing to compile"
        print(f"{did} in {made.wall_s:.1f} s; {made.kernels} are in {made.folder}", file=output.stream)
    return 0
