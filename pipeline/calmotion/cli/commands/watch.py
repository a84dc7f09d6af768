"""`calmotion watch`: the shot simulated or optimised again whenever it is saved."""

from __future__ import annotations

import argparse
import time
from typing import TYPE_CHECKING, Any

from calmotion.cli import (
    FAILED,
    Output,
    count_of,
    length,
    notice,
    print_error,
    run_options,
    shot_arguments,
    simulation_options,
)

if TYPE_CHECKING:
    from calmotion.workflow.results import SimulationResult
    from calmotion.workflow.shot import Shot

EXAMPLES = (
    ("calmotion watch shot.usda", "how much does it shake, after each save?"),
    ("calmotion watch shot.usda --optimize -o calm.usda", "and its cure"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument("-o", "--output", metavar="LAYER", help="USD layer to write after each run")
    command.add_argument(
        "--optimize", action="store_true", help="optimise instead of simulating; a search begins with the last curves"
    )
    command.add_argument(
        "--runs", type=count_of("runs"), metavar="N", help="end after this many runs (default: until Ctrl-C)"
    )
    run_options(command)
    simulation_options(command, "as of simulate or optimize")


def run(args: argparse.Namespace, output: Output) -> int:
    """Simulate or optimise a shot whenever it is saved, and print a line for each run; the exit status of the last.

    Raises:
        SettingError: An option or setting does not fit.
    """
    from calmotion.cli.run import run_once, shot_to_run
    from calmotion.errors import ShotError
    from calmotion.host import SettingError
    from calmotion.support import interrupts
    from calmotion.workflow.commands import optimize, simulate
    from calmotion.workflow.watch import Watch

    if args.optimize and not args.output:
        raise SettingError("optimize writes a layer", path="-o", remedy="Name it with -o LAYER.")
    reports: list[dict[str, Any]] = []

    def once(shot: Shot) -> SimulationResult:
        result, report = run_once(optimize if args.optimize else simulate, shot, args, True)  # a run has one line
        reports.append(report)
        return result

    watch, done, status = Watch(shot_to_run(args), once), 0, 0
    if not args.quiet:
        notice(f"watching {args.shot}; Ctrl-C ends it")
    while args.runs is None or done < args.runs:
        try:
            if done:
                watch.wait()
        except KeyboardInterrupt:
            interrupts.answer()
            return 0
        begin = time.perf_counter()
        try:
            result = watch.run()
        except ShotError as error:  # the next save may repair it
            print_error(error, output)
            status = FAILED
        else:
            more = {"reused": watch.reused, "made": watch.made, "seconds": time.perf_counter() - begin}
            status = _tell(result, reports.pop() | more, args, output)
            if result.interrupted:
                return status
        done += 1
    return status


def _tell(result: SimulationResult, report: dict[str, Any], args: argparse.Namespace, output: Output) -> int:
    """Print one line for a run; the exit status that it has alone."""
    from calmotion.cli.run import status_of
    from calmotion.workflow.watch import largest_error

    if output.json:
        output.object(report)
    elif not args.quiet:
        path, meters, moment = largest_error(result)
        before = report.get("max_error_before_m")
        largest = length(meters) if before is None else f"{length(before)} to {length(meters)}"
        did = f"{'optimised' if args.optimize else 'simulated'} in {report['seconds']:.2f} s"
        verdict = "tolerance kept" if report["tolerance_kept"] else "tolerance missed"
        steps = [f"; {kind} {', '.join(report[kind])}" for kind in ("reused", "made") if args.verbose and report[kind]]
        error = f"largest error {largest} of {path} at {moment:.2f} s"
        print(
            f"{time.strftime('%H:%M:%S')} {did}: {error}, {verdict}{''.join(steps)}",
            *(f"  {problem.error}" for problem in result.problems),
            sep="\n",
            file=output.stream,
            flush=True,
        )
    return status_of(result, report, args)
