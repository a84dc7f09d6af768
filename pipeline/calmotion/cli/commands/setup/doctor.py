"""`calmotion doctor`: what is wrong with this installation and this machine, and what to do."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from calmotion.cli.options import json_option

if TYPE_CHECKING:
    from calmotion.cli.output import Output

EXAMPLES = (("calmotion doctor", "is everything in its place?"),)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.description = f"{command.description} Exit status 1 if something is wrong."
    json_option(command)


def run(args: argparse.Namespace, output: Output) -> int:
    from dataclasses import asdict

    from calmotion.cli.diagnostics.machine import NOTE, OK, WRONG, examine

    findings = examine()
    wrong = sum(one.state == WRONG for one in findings)
    if output.json:
        output.object({"findings": [asdict(one) for one in findings], "wrong": wrong})
        return int(wrong > 0)
    from calmotion.cli.quantities import counted
    from calmotion.cli.tables import console_on, say

    console = console_on(output.stream)
    notes = sum(one.state == NOTE for one in findings)
    verdict = f"{counted(wrong, 'thing')} wrong (X)" if wrong else "nothing is wrong"
    say(console, f"{verdict}, {counted(notes, 'thing')} to note (!)" if notes else verdict)
    width = max(len(one.name) for one in findings)
    for one in sorted(findings, key=lambda one: (WRONG, NOTE, OK).index(one.state)):
        mark = {OK: "  ", NOTE: "! ", WRONG: "X "}[one.state]
        say(console, f"{mark}{one.name:{width}}  {one.found}")
        if one.remedy:
            say(console, f"  {'':{width}}  do: {one.remedy}")
    return int(wrong > 0)
