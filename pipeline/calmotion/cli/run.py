"""What `simulate`, `optimize` and `watch` have in common: arguments of the workflow, and the report."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from calmotion.cli.options import opened_shot, progress_display, run_arguments, simulation_arguments
from calmotion.cli.output import FAILED, INTERRUPTED, Output, conclude
from calmotion.shot.run import OutputPaths
from calmotion.support import interrupts
from calmotion.workflow.results import SimulationResult

if TYPE_CHECKING:
    from calmotion.workflow.shot import Shot
    from calmotion.workflow.watch import Watch


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
    paths = OutputPaths(layer=args.output, rrd=args.rrd, csv=args.csv, figures=args.figures, video=args.video)
    _refuse_files(shot, args, paths)
    with progress_display(args) as display:
        result = function(
            shot,
            verify=args.verify,
            outputs=paths,
            **simulation_arguments(args),
            **run_arguments(args, display),
            **options,
        )
    report = result.report()
    if manifest := _write_manifest(result, args):
        report["manifest"] = manifest
    conclude(report, result.problems, output, None if args.quiet else partial(print_run, verbose=args.verbose))
    return _status(result, report, args)


def _status(result: SimulationResult, report: dict[str, Any], args: argparse.Namespace) -> int:
    """The exit status of a run."""
    if result.interrupted:
        return INTERRUPTED
    unlike = any(row["unlike_ground"] for row in report["contacts"])
    return FAILED if result.problems or (args.strict and (unlike or not report["tolerance_kept"])) else 0


def _refuse_files(shot: Shot, args: argparse.Namespace, paths: OutputPaths) -> None:
    """Refuse a manifest over what is read or another output, and options of a layer that is not written.

    Raises:
        SettingError: One is.
    """
    from calmotion.host import SettingError
    from calmotion.workflow.outputs import files_of, refuse_overwriting

    own = {"--manifest": args.manifest} if args.manifest else {}
    refuse_overwriting(shot.inputs, files_of(paths) | own)
    if args.manifest and not _may_be_manifest(args.manifest):
        raise SettingError(
            "the file that is there is no manifest, and is never changed", path="--manifest", found=args.manifest,
            remedy="Choose another.",
        )  # fmt: skip
    of_layer = {"--bake": args.bake, "--samples-per-second": args.samples_per_second, "--splines": args.splines}
    unused = [option for option, value in of_layer.items() if value]
    if unused and not args.output:
        raise SettingError(
            "this option says how the layer is written, and no layer is", path=unused[0],
            remedy=f"Name one with -o, or leave {unused[0]} out.",
        )  # fmt: skip


def _may_be_manifest(path: str) -> bool:
    """Whether a file is absent, empty or begins as JSON does: a layer or a mesh of the shot does not."""
    if not os.path.isfile(path):
        return True
    with open(path, "rb") as file:
        return file.read(64).strip()[:1] in (b"", b"{")


def _write_manifest(result: SimulationResult, args: argparse.Namespace) -> str | None:
    """The manifest that is requested, of a run that made all it was asked for."""
    if not args.manifest or result.problems or result.interrupted:
        return None
    from calmotion.workflow.publishing.manifest import write_manifest

    return write_manifest(result, args.manifest)


def watch_shot(args: argparse.Namespace, output: Output) -> int:
    """Simulate or optimise a shot whenever it is saved, and print a line for each run; the exit status of the last.

    Raises:
        SettingError: An option or setting does not fit.
    """
    from calmotion.cli.output import notice, print_error
    from calmotion.errors import ShotError
    from calmotion.host import SettingError
    from calmotion.workflow.commands import optimize, simulate
    from calmotion.workflow.watch import Watch

    if args.optimize and not args.output:
        raise SettingError("optimize writes a layer", path="-o", remedy="Name it with -o LAYER.")
    paths = OutputPaths(layer=args.output, rrd=args.rrd, csv=args.csv, figures=args.figures, video=args.video)

    def run(shot: Shot) -> SimulationResult:
        function = optimize if args.optimize else simulate
        with progress_display(args, quiet=True) as display:  # a run has one line
            options = run_arguments(args, display) | simulation_arguments(args)
            return function(shot, verify=args.verify, outputs=paths, **options)

    shot = opened_shot(args)
    _refuse_files(shot, args, paths)
    watch, done, status = Watch(shot, run), 0, 0
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
            _write_manifest(result, args)
        except ShotError as error:  # the next save may repair it
            print_error(error, output)
            status = FAILED
        else:
            status = _tell(result, watch, time.perf_counter() - begin, args, output)
            if result.interrupted:
                return status
        done += 1
    return status


def _tell(result: SimulationResult, watch: Watch, seconds: float, args: argparse.Namespace, output: Output) -> int:
    """Print one line for a run; the exit status that it has alone."""
    from calmotion.cli.quantities import length
    from calmotion.workflow.watch import largest_error

    report: dict[str, Any] = result.report()
    status = _status(result, report, args)
    if output.json:
        output.object(report | {"reused": watch.reused, "made": watch.made, "seconds": seconds})
        return status
    if args.quiet:
        return status
    path, error, moment = largest_error(result)
    verdict = "tolerance kept" if report["tolerance_kept"] else "tolerance missed"
    what = "optimised" if args.optimize else "simulated"
    before = report.get("max_error_before_m")
    largest = length(error) if before is None else f"{length(before)} to {length(error)}"
    reused = f"; reused {', '.join(watch.reused)}" if watch.reused else ""
    reused += f"; made {', '.join(watch.made)}" if watch.made else ""
    print(
        f"{time.strftime('%H:%M:%S')} {what} in {seconds:.2f} s: largest error {largest} of {path} at "
        f"{moment:.2f} s, {verdict}{reused if args.verbose else ''}",
        file=output.stream, flush=True,
    )  # fmt: skip
    for problem in result.problems:
        print(f"  {problem.error}", file=output.stream, flush=True)
    return status
