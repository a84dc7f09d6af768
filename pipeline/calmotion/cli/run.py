"""What `simulate` and `optimize` have in common: arguments of the workflow, and the report."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from calmotion.cli.options import opened_shot, run_arguments, simulation_arguments
from calmotion.cli.output import FAILED, INTERRUPTED, Output, conclude
from calmotion.cli.progress import ProgressDisplay
from calmotion.shot.run import OutputPaths
from calmotion.workflow.results import SimulationResult


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
    from calmotion.cli.run_report import print_run

    shot = opened_shot(args)
    with ProgressDisplay(args.quiet, args.progress) as display:
        result = function(
            shot,
            verify=args.verify,
            outputs=OutputPaths(layer=args.output, rrd=args.rrd, csv=args.csv, figures=args.figures),
            **simulation_arguments(args),
            **run_arguments(args, display),
            **options,
        )
    report = result.report()
    conclude(report, result.problems, output, None if args.quiet else print_run)
    if result.interrupted:
        return INTERRUPTED
    return FAILED if result.problems or (args.strict and not report["tolerance_kept"]) else 0
