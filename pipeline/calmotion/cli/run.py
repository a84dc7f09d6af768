"""`calmotion simulate` and `calmotion optimize`."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TextIO

from calmotion.cli.output import Output, Problem
from calmotion.cli.progress import ProgressDisplay
from calmotion.errors import ShotError, each
from calmotion.host import (
    Host,
    HostError,
    OperatorResult,
    Run,
    SettingError,
    Settings,
    merge,
    nearest,
    open_host,
    read_assignment,
    read_settings_file,
)
from calmotion.shot.outputs import CsvFile, Figures, Recording, Verification, WrittenLayer
from calmotion.shot.run import OutputPaths, Source

FAILED, INTERRUPTED = 1, 130


def settings_of(args: argparse.Namespace) -> Settings:
    """Settings from `--settings`, `--keep` and `--leave-out`, and `--set`, each stronger than the one before.

    Raises:
        SettingError: When a file or an assignment cannot be read.
    """
    file = [read_settings_file(args.settings)] if args.settings else []
    return merge([*file, _forced_needs(args), *(read_assignment(text) for text in args.set)])


def _forced_needs(args: argparse.Namespace) -> Settings:
    from calmotion.shot.model_choice import KINDS, OFF, ON

    forced: dict[str, object] = {}
    for given, choice in ((getattr(args, "leave_out", []), OFF), (getattr(args, "keep", []), ON)):
        forced |= {kind: choice for name in given for kind in (KINDS if name == "all" else (name,))}
    return {"needs.analyse": forced} if forced else {}


def _options_of_the_writer(args: argparse.Namespace) -> Settings:
    given = {"bake": args.bake, "samples_per_second": args.samples_per_second, "splines": args.splines or None}
    chosen: dict[str, object] = {name: value for name, value in given.items() if value is not None}
    return {"usd.write": chosen} if chosen else {}


def run_shot(args: argparse.Namespace, command: str, output: Output) -> int:
    """Simulate or optimise a shot and report; the exit status.

    Raises:
        ShotError: When nothing could be computed.
        SettingError: When an option or setting does not fit.
    """
    start = time.perf_counter()
    from calmotion.shot import Character, Result

    paths = OutputPaths(layer=args.output, rrd=args.rrd, csv=args.csv, figures=args.figures)
    host = open_host(args.plugins)
    wanted = [Character, Result, *_wanted_files(host, paths), *asked_for(host, args)]
    wanted += [Verification] if args.verify else []
    source = Source(
        path=args.shot,
        command=command,
        tolerance=args.tolerance,
        step=args.step,
        pre_roll=args.pre_roll,
        shaper=getattr(args, "shaper", None),
        motion=args.motion,
        verify=args.verify,
        integrator=args.integrator,
    )
    _refuse_unreadable_motion(source, host)
    tell_failures(host, args.quiet)
    with ProgressDisplay(args.quiet, args.progress) as display:
        settings = merge([settings_of(args), _options_of_the_writer(args)])
        run = host.run([source, paths], wanted, settings=settings, progress=display)
        _prepare_folders(args.shot, paths)
        interrupted = carry_out(run, display)

    character, result = run.get(Character), run.get(Result)
    problems = [Problem(ShotError("interrupted"))] if interrupted else problems_of(run, wanted)
    report: dict[str, Any] = {}
    if result and result.interrupted:
        interrupted = True
    elif result and paths.layer and not problems and command == "optimize":
        from calmotion.retargeting.checkpoint import checkpoint_path

        checkpoint_path(paths.layer).unlink(missing_ok=True)
    if character and result:
        from calmotion.cli.report import run_report

        report = run_report(run, character, result, command, time.perf_counter() - start)
    status = conclude(report, problems, output, None if args.quiet else _print_run)
    return INTERRUPTED if interrupted else status


def asked_for(host: Host, args: argparse.Namespace) -> list[type]:
    """What the operators make that the user asked for by name.

    Raises:
        SettingError: There is no such operator.
    """
    kinds: list[type] = []
    for idname in args.run:
        if idname not in host.operators:
            known = ", ".join(host.operators)
            raise SettingError(
                "there is no such operator",
                path="--run",
                found=idname,
                remedy=f"{nearest(idname, host.operators)}The operators are {known}",
            )
        kinds += host.operators[idname].provides
    return kinds


def _refuse_unreadable_motion(source: Source, host: Host) -> None:
    """Refuse a motion that no plugin reads, before anything costly.

    Raises:
        SettingError: None does.
    """
    from calmotion.shot import MotorTracks

    readers = host.providers(MotorTracks)
    if source.motion is not None and all(cls.poll({Source: source}) is not None for cls in readers):
        raise SettingError(
            "no plugin reads this motion",
            path="--motion",
            found=source.motion,
            remedy="Name a .bvh file, or a plugin that provides MotorTracks with --plugins",
        )


def tell_failures(host: Host, quiet: bool) -> None:
    """Tell of plugins that could not be loaded, each with its own traceback; the run goes on without them."""
    for plugin in host.failures() if not quiet else ():
        print(plugin.traceback, end="", file=sys.stderr)
        print(f"warning: the plugin {plugin.id} is not used: {plugin.error}", file=sys.stderr, flush=True)


def _wanted_files(host: Host, paths: OutputPaths) -> list[type]:
    """The types that the asked-for files are made as."""
    kinds: list[type] = []
    for kind, option, path in (
        (WrittenLayer, "-o", paths.layer),
        (CsvFile, "--csv", paths.csv),
        (Recording, "--rrd", paths.rrd),
        (Figures, "--figures", paths.figures),
    ):
        if path is None:
            continue
        if not host.providers(kind):
            failed = "; ".join(f"{plugin.id}: {plugin.error}" for plugin in host.failures())
            raise SettingError(
                "no plugin is there that writes this",
                path=option,
                found=path,
                remedy=f"Plugins that failed: {failed}" if failed else f"Install one that provides {kind.__name__}.",
            )
        kinds.append(kind)
    return kinds


def _prepare_folders(shot: str, paths: OutputPaths) -> None:
    """Find out before the long work that an output cannot be written."""
    for option, path in (("-o", paths.layer), ("--csv", paths.csv), ("--rrd", paths.rrd), ("--figures", paths.figures)):
        if path is None:
            continue
        if Path(path).resolve() == Path(shot).resolve():
            raise SettingError("this is the shot, which is never written to", path=option, found=path)
        try:
            (Path(path) if option == "--figures" else Path(path).parent).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise SettingError(
                "the folder cannot be made", path=option, found=f"{path}: {error.strerror}", remedy="Choose another."
            ) from error


def carry_out(run: Run, display: ProgressDisplay) -> bool:
    """Carry out a run; whether the user interrupted it."""
    try:
        for result in run:
            display.done(result)
    except KeyboardInterrupt:
        return True
    return False


def problems_of(run: Run, wanted: list[type]) -> list[Problem]:
    """What went wrong: operators that raised, else wanted values that were left out for another reason."""
    problems = [problem for result in run.failures() for problem in _problems(result)]
    if problems:
        return problems
    for kind in wanted:
        if run.get(kind) is None:
            makers = {cls.idname for cls in run.plan.operators if kind in cls.provides}
            reasons = "; ".join(f"{row.idname}: {row.reason}" for row in run.results if row.idname in makers)
            problems.append(Problem(HostError(f"there is no {kind.__name__}", found=reasons or None)))
    return problems


def _problems(result: OperatorResult) -> list[Problem]:
    error = result.error
    # A ShotError is the user's to solve; anything else is the plugin's, and its author needs the traceback.
    if isinstance(error, ShotError):
        return [Problem(one, result.idname, result.plugin) for one in each(error)]
    raised = HostError(
        f"the operator {result.idname} of the plugin {result.plugin} raised {type(error).__name__}",
        found=str(error) or None,
        remedy="Report this to the plugin's maintainer, with the traceback.",
    )
    return [Problem(raised, result.idname, result.plugin, result.traceback)]


def conclude(
    report: dict[str, Any],
    problems: list[Problem],
    output: Output,
    show: Callable[[dict[str, Any], TextIO], None] | None,
) -> int:
    """Print the report and the problems.

    Args:
        report: What was computed; empty when nothing was.
        problems: What went wrong.
        output: Where to.
        show: Prints the report for a person; None prints nothing.

    Returns:
        The exit status.
    """
    if output.json:
        errors = [problem.as_dict() for problem in problems]
        output.object(report | ({"error": errors[0], "errors": errors} if errors else {}))
    else:
        if report and show:
            show(report, output.stream)
        for problem in problems:
            problem.tell()
    return FAILED if problems else 0


def _print_run(report: dict[str, Any], stream: TextIO) -> None:
    from calmotion.cli.tables import print_run

    print_run(report, stream)
