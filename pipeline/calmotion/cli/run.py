"""What `simulate`, `optimize` and `watch` have in common: arguments of the workflow, and the report."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from calmotion.cli.options import opened_shot, progress_display, run_arguments, simulation_arguments
from calmotion.cli.output import FAILED, INTERRUPTED, Output, conclude, notice
from calmotion.host import SettingError
from calmotion.model.run import OutputPaths
from calmotion.workflow.results import SimulationResult

if TYPE_CHECKING:
    from calmotion.workflow.shot import Shot


def run_shot(
    function: Callable[..., SimulationResult], args: argparse.Namespace, output: Output, **options: Any
) -> int:
    """Simulate or optimise a shot and print the report; the exit status.

    Args:
        function: `calmotion.simulate` or `calmotion.optimize`.
        args: Arguments of the command line.
        output: Where the report is printed.
        options: Arguments of the function that only one of them has.

    Raises:
        ShotError: When nothing could be computed.
        SettingError: When an option or setting does not fit.
    """
    from calmotion.cli.reports.run import print_run
    from calmotion.workflow.warmup import first_run

    shot = shot_to_run(args)
    with first_run(lambda line: None if args.quiet or sys.stderr.isatty() else notice(line)):  # a terminal has bars
        result, report = run_once(function, shot, args, args.quiet, **options)
    conclude(report, result.problems, output, None if args.quiet else partial(print_run, verbose=args.verbose))
    return status_of(result, report, args)


def shot_to_run(args: argparse.Namespace) -> Shot:
    """The shot of `simulate`, `optimize` or `watch`, whose options fit.

    Raises:
        SettingError: A manifest over what is read, over another output or over a file of another kind, or an option of
            a layer that is not written.
    """
    from calmotion.workflow.outputs import files_of, refuse_overwriting

    shot = opened_shot(args)
    manifest = {"--manifest": args.manifest} if args.manifest else {}
    refuse_overwriting(shot.inputs, files_of(_paths(args)) | manifest)
    if args.manifest and not _may_be_manifest(args.manifest):
        raise SettingError(
            "the file that is there is no manifest, and is never changed",
            path="--manifest",
            found=args.manifest,
            remedy="Choose another.",
        )
    of_layer = {"--bake": args.bake, "--samples-per-second": args.samples_per_second, "--splines": args.splines}
    unused = [option for option, value in of_layer.items() if value]
    if unused and not args.output:
        raise SettingError(
            "this option says how the layer is written, and no layer is",
            path=unused[0],
            remedy=f"Name one with -o, or leave {unused[0]} out.",
        )
    return shot


def run_once(
    function: Callable[..., SimulationResult], shot: Shot, args: argparse.Namespace, quiet: bool, **options: Any
) -> tuple[SimulationResult, dict[str, Any]]:
    """Simulate or optimise a shot, and write the manifest of a run that made all it was asked for; result and report.

    Raises:
        ShotError: When nothing could be computed.
    """
    with progress_display(args, quiet) as display:
        options |= simulation_arguments(args) | run_arguments(args, display)
        result = function(shot, verify=args.verify, outputs=_paths(args), **options)
    report = result.report()
    if args.html:
        from calmotion.cli.pages import write_page

        report["html"] = write_page(result, args.html)
    if args.manifest and not result.problems and not result.interrupted:
        from calmotion.workflow.manifest import write_manifest

        report["manifest"] = write_manifest(result, args.manifest)
    return result, report


def status_of(result: SimulationResult, report: dict[str, Any], args: argparse.Namespace) -> int:
    """The exit status of a run."""
    if result.interrupted:
        return INTERRUPTED
    unlike = any(row["unlike_ground"] for row in report["contacts"])
    worse = report.get("improved") is False or report.get("goal_kept") is False
    missed = unlike or not report["tolerance_kept"] or worse
    return FAILED if result.problems or (args.strict and missed) else 0


def _paths(args: argparse.Namespace) -> OutputPaths:
    return OutputPaths(
        layer=args.output, rrd=args.rrd, csv=args.csv, figures=args.figures, video=args.video, html=args.html
    )


def _may_be_manifest(path: str) -> bool:
    """Whether a file is absent, empty or begins as JSON does: a layer or a mesh of the shot does not."""
    if not os.path.isfile(path):
        return True
    with open(path, "rb") as file:
        return file.read(64).strip()[:1] in (b"", b"{")
