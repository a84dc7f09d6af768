"""`calmotion submit`: a job template for a render farm."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any, TextIO

from calmotion.cli.commands.shows.forwarding import command_of, extras_of, forwarded, forwarded_options
from calmotion.cli.options import Commands, file_argument, report_options

if TYPE_CHECKING:
    from calmotion.cli.output import Output


def add_to(commands: Commands) -> None:
    """Add the command."""
    text = "write a job template for a render farm (OpenJD)"
    command = commands.add_parser("submit", help=text, description=text[0].upper() + text[1:] + ".")
    command.set_defaults(command=_run)
    file_argument(command, "shots", metavar="SHOTS", nargs="+", help="USD files, by paths that the farm sees as well")
    file_argument(command, "--openjd", metavar="TEMPLATE", required=True, help="YAML file to write")
    file_argument(command, "-o", "--output", metavar="DIR", required=True, help="folder of the results")
    report_options(command)
    forwarded_options(command)


def _run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli.output import conclude
    from calmotion.workflow.batch.jobs import jobs_for
    from calmotion.workflow.batch.openjd import write_template

    jobs = jobs_for(args.shots, args.output, command_of(args), forwarded(args), extras_of(args))
    template = write_template(args.openjd, jobs)
    report = {"command": "submit", "template": args.openjd, "name": template["name"], "tasks": len(jobs)}
    conclude(report, [], output, None if args.quiet else _print)
    return 0


def _print(report: dict[str, Any], stream: TextIO) -> None:
    print(
        f"wrote {report['template']}: {report['tasks']} tasks; try it here: openjd run {report['template']}",
        file=stream,
    )
