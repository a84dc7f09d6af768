"""`calmotion submit`: a job template for a render farm."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from calmotion.cli import Output, conclude, report_options, say

from .forwarding import command_of, extras_of, forwarded, forwarded_options

if TYPE_CHECKING:
    from rich.console import Console

EXAMPLES = (("calmotion submit shots/*.usda --openjd job.yaml -o /farm/calm", "a task for each shot"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.add_argument("shots", metavar="SHOTS", nargs="+", help="USD files, by paths that the farm sees as well")
    command.add_argument("--openjd", metavar="TEMPLATE", required=True, help="YAML file to write")
    command.add_argument("-o", "--output", metavar="DIR", required=True, help="folder of the results")
    report_options(command)
    forwarded_options(command)


def run(args: argparse.Namespace, output: Output) -> int:
    from ..batch.jobs import jobs_for
    from ..batch.openjd import write_template

    jobs = jobs_for(args.shots, args.output, command_of(args), forwarded(args), extras_of(args))
    template = write_template(args.openjd, jobs)
    report = {"command": "submit", "template": args.openjd, "name": template["name"], "tasks": len(jobs)}
    conclude(report, [], output, None if args.quiet else _print)
    return 0


def _print(report: dict[str, Any], console: Console) -> None:
    say(console, f"wrote {report['template']}: {report['tasks']} tasks; try it here: openjd run {report['template']}")
