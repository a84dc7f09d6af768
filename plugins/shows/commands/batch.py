"""`calmotion batch`: many shots as independent jobs."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from calmotion.cli import (
    FAILED,
    INTERRUPTED,
    Output,
    conclude,
    count_of,
    counted,
    html_option,
    length,
    page_of_report,
    print_table,
    report_options,
    say,
)

from .forwarding import command_of, extras_of, forwarded, forwarded_options

if TYPE_CHECKING:
    from rich.console import Console

# Outcomes in words, where the word of the JSON object says too little.
SAID = {"kept": "done before, nothing has changed"}


EXAMPLES = (
    ("calmotion batch shots/*.usda -o calm --workers 2", "two shots at a time, on this machine"),
    ("calmotion batch shots/*.usda -o calm --on dask://host:8786", "on the workers of a Dask scheduler"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.add_argument("shots", metavar="SHOTS", nargs="+", help="USD files")
    command.add_argument(
        "-o",
        "--output",
        metavar="DIR",
        required=True,
        help="folder for layers, manifests, logs and the report; the same command goes on after an interruption",
    )
    report_options(command)
    command.add_argument("--progress", action="store_true", help="print machine-readable progress to stderr")
    html_option(command)
    group = command.add_argument_group("workers")
    group.add_argument("--on", metavar="WHERE", default="local", help="local (default) or dask://HOST:PORT")
    group.add_argument(
        "--workers",
        metavar="N",
        type=count_of("workers"),
        help="largest number of jobs at once (default: one for each processor; on a cluster all)",
    )
    forwarded_options(command)


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.cli import ProgressDisplay
    from calmotion.host import open_host
    from calmotion.workflow import prepare_page

    from ..batch.run import batch

    inputs = {f"shot {k}": shot for k, shot in enumerate(args.shots, start=1)}
    host = open_host(args.plugins) if args.html else None
    if host is not None:
        prepare_page(host, args.html, inputs)
    with ProgressDisplay(args.quiet, args.progress) as display:
        result = batch(
            args.shots, args.output, command=command_of(args), arguments=forwarded(args), extras=extras_of(args),
            on=args.on, workers=args.workers, progress=display,
        )  # fmt: skip
    report = result.report()
    if host is not None:
        report["html"] = page_of_report(host, args.html, report, SECTIONS, inputs)
    conclude(report, [], output, None if args.quiet else _print)
    if result.interrupted:
        return INTERRUPTED
    return 0 if result.successful else FAILED


def _print_answer(report: dict[str, Any], console: Console) -> None:
    counts = ", ".join(f"{count} {SAID.get(name, name)}" for name, count in report["outcomes"].items())
    say(console, f"{counted(len(report['jobs']), 'shot')} in {report['wall_s']:.1f} s: {counts}")
    rows = []
    for job in report["jobs"]:
        result = SAID.get(job["outcome"], job["outcome"])
        result += ", tolerance missed" if job["tolerance_kept"] is False else ""
        result += f", {job['attempts']} attempts" if job["attempts"] > 1 else ""
        errors = job.get("max_error_before_m", job.get("max_error_m")), job.get("max_error_after_m")
        rows.append([job["name"], result, *("" if error is None else length(error) for error in errors)])
    width = 4 if any(row[3] for row in rows) else 3
    heads = ["shot", "result", "largest error", "optimised"][:width]
    print_table(console, "Shots", heads, [row[:width] for row in rows], texts=2)
    for job in report["jobs"]:
        if problem := job["problem"]:
            place = ".".join(filter(None, (problem.get("path"), problem.get("attribute"))))
            found = f" ({problem['found']})" if problem.get("found") else ""
            remedy = f" {problem['remedy'].rstrip('.')}." if problem.get("remedy") else ""
            what = f"{place + ': ' if place else ''}{problem['problem']}{found}"
            say(console, f"{job['name']}: {what}.{remedy} Log: {job['log']}")


SECTIONS = {"Result": _print_answer}


def _print(report: dict[str, Any], console: Console) -> None:
    _print_answer(report, console)
    if report["html"]:
        say(console, f"wrote {report['html']}")
    say(console, f"report: {report['folder']}/batch.json")
    roots = [job["root_layer"] for job in report["jobs"] if job["root_layer"]]
    if roots:
        say(console, f"next: open {roots[0]}{' (one for each shot)' if len(roots) > 1 else ''}")
    if len(roots) < len(report["jobs"]):
        say(console, "next: the same command runs only what is not done")
