"""`calmotion live`: calm a stream of joint angles while it is played."""

from __future__ import annotations

import argparse
import json
import os
import stat
import sys
from typing import TYPE_CHECKING

from calmotion.cli import Output, assignments, notice, opened_shot, progress_display, quantity, shot_arguments

if TYPE_CHECKING:
    from calmotion.model import Animation

    from ..lines import Sink, Source
    from ..session import Live

SLOWEST = 1.0  # samples a second of a sender whose stamps may be right

EXAMPLES = (
    ("calmotion live robot.usda --rate 250 --lookahead 120", "JSON lines in and out"),
    ("calmotion live robot.usda --in osc://127.0.0.1:9000 --out osc://127.0.0.1:9001", "faders over OSC"),
    ("calmotion live robot.usda --replay calm_root.usda", "play the motion of a shot as a stream"),
)


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    shot_arguments(command)
    command.add_argument(
        "--rate",
        metavar="HZ",
        type=quantity("Hz", positive=True),
        default=250.0,
        help="commands a second (default: 250)",
    )
    command.add_argument(
        "--lookahead",
        metavar="MS",
        type=_milliseconds,
        default=0.12,
        help="delay of the robot behind the samples, in ms or with a unit (default: 120)",
    )
    command.add_argument(
        "--sender-rate",
        metavar="HZ",
        type=quantity("Hz", positive=True),
        help="samples a second of a sender that is slower than --rate; its motion is played two samples later",
    )
    command.add_argument(
        "--uncertainty",
        metavar="SHARE",
        type=_share,
        help="uncertainty of the robot's frequencies: 0.1 calms slower and faster robots as much as that of the model, "
        "0 that of the model alone (default: others as far as that of the model hardly shakes more)",
    )
    command.add_argument(
        "--in",
        dest="source",
        metavar="PLACE",
        default="-",
        help="where samples come from: - (JSON lines on standard input, default) or osc://HOST:PORT",
    )
    command.add_argument(
        "--out",
        dest="sink",
        metavar="PLACE",
        default="-",
        help="where commands go: - (JSON lines on standard output, default) or osc://HOST:PORT",
    )
    command.add_argument(
        "--rrd",
        metavar="PLACE",
        help="show samples and commands in rerun: a file, or a viewer that runs: rerun+http://127.0.0.1:9876/proxy",
    )
    command.add_argument("--replay", metavar="LAYER", help="play the animation of a shot or a layer as the stream")
    command.add_argument(
        "--clock",
        choices=("wall", "stamps"),
        help="clock that times the commands. wall: that of the machine (default of a pipe and of OSC); stamps: the "
        "time stamps of the samples, as fast as they can be read (default of a file and of --replay)",
    )
    command.add_argument("--seconds", metavar="S", type=quantity("s", positive=True), help="stop after this time")


def _milliseconds(text: str) -> float:
    """A time without a unit is in milliseconds."""
    from calmotion.host import has_no_unit

    return quantity("s")(f"{text}ms" if has_no_unit(text) else text)


def _share(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value <= 0.5:
        raise argparse.ArgumentTypeError(f"{text} is not a share from 0 to 0.5, such as 0.1")
    return value


def run(args: argparse.Namespace, output: Output) -> int:
    from calmotion.host import SettingError
    from calmotion.workflow import Hooks, Shot, with_shot

    from ..lines import LineSink, OscSink, osc_place
    from ..opening import live
    from ..settings import LiveSettings

    listens, sends = osc_place(args.source, "--in"), osc_place(args.sink, "--out")
    if args.json and not sends:
        raise SettingError(
            "standard output holds the commands", path="--json", remedy="Send them elsewhere: --out osc://HOST:PORT."
        )
    if listens and (args.replay or args.clock == "stamps"):
        other = "--replay" if args.replay else "--clock"
        raise SettingError(
            "a stream of OSC comes by the clock of this machine, and is the only one",
            path=other,
            remedy=f"Leave {other} out, or --in.",
        )
    stamps = args.clock == "stamps" or (args.clock is None and listens is None and (args.replay or _is_file()))
    shot = opened_shot(args)
    replayed = Shot(with_shot(args.replay)).animation if args.replay else None  # before any mesh
    settings = LiveSettings(sender_rate=args.sender_rate, uncertainty=args.uncertainty, background=not stamps)
    with progress_display(args) as display:
        robot = live(
            shot,
            lookahead=args.lookahead,
            rate=args.rate,
            settings=settings,
            operators=assignments(args),
            hooks=Hooks(progress=display, on_operator=display.done),
        )
    sink: Sink = OscSink(*sends) if sends else LineSink(sys.stdout)
    with robot:
        for note in robot.notes:
            notice(note)
        notice(f"commands are {1e3 * robot.latency_s:.0f} ms behind the samples")
        if args.rrd:
            from ..viewer import Viewer

            sink = Viewer(args.rrd, sink, robot)
        try:
            source = _play(robot, args, replayed, stamps, listens, sink)
        finally:
            sink.close()
        _tell(robot, source)
        if args.json:
            print(json.dumps(robot.report()))
    return 0


def worth_of_lookahead(args: argparse.Namespace, output: Output) -> int:
    """Print what look-aheads are worth to the robot of a shot, for `calmotion inspect --live`."""
    from dataclasses import asdict

    from calmotion.cli import console_on, print_table
    from calmotion.workflow import Hooks

    from ..lookahead import cells, worth_of_lookahead
    from ..opening import compiled
    from ..settings import LiveSettings

    asked = LiveSettings()
    shot = opened_shot(args)
    with progress_display(args) as display:
        robot = compiled(shot, assignments(args), Hooks(progress=display, on_operator=display.done))
    rows, notes = worth_of_lookahead(robot, asked)
    if output.json:
        output.object({"lookahead": [asdict(row) for row in rows], "notes": list(notes)})
        return 0
    title = f"The motion of the shot as a stream, {asked.rate:g} commands a second; errors of the simulated robot"
    heads = ("look-ahead", "behind by", "rms error", "largest error", "what limits it")
    print_table(console_on(output.stream), title, heads, cells(rows))
    for note in notes:
        notice(note)
    return 0


def _play(
    robot: Live,
    args: argparse.Namespace,
    replayed: Animation | None,
    stamps: bool,
    listens: tuple[str, int] | None,
    sink: Sink,
) -> Source:
    from ..lines import Lines, OscSource, Samples
    from ..playing import play_clock, play_stamps, samples_of_animation

    source: Source
    if replayed is not None:
        source = Samples(samples_of_animation(robot, replayed))
    elif listens:
        source = OscSource(*listens)
    else:
        source = Lines(sys.stdin, waits=not stamps)
    if stamps:
        play_stamps(robot, source.samples(), sink, args.seconds)
    else:
        play_clock(robot, source, sink, args.seconds)
    return source


def _is_file() -> bool:
    """Whether standard input is a file, whose samples are all there."""
    try:
        return stat.S_ISREG(os.fstat(sys.stdin.fileno()).st_mode)
    except (OSError, ValueError):
        return False


def _tell(robot: Live, source: Source) -> None:
    """What happened, in a few words on standard error."""
    from ..lines import Samples
    from ..stream import BEYOND, RESTARTED

    report = robot.report()
    rate = report["sender_rate"]
    events = ", ".join(f"{count} {name}" for name, count in sorted(report["events"].items()))
    notice(f"{report['ticks']} commands for {report['samples']} samples{': ' if events else ''}{events}")
    if source.fault:
        were = "message was" if source.faults == 1 else "messages were"
        notice(f"{source.faults} {were} left out; the first: {source.fault}")
    restarts, asked = report["events"].get(RESTARTED, 0), robot.settings.sender_rate
    if (rate and rate < SLOWEST) or restarts > 0.5 * report["samples"] > 1:
        notice("the time stamps of samples are far apart: they have to be in seconds")
    elif rate and (rate < 0.8 * (asked or robot.settings.rate) or (asked and rate > 1.25 * asked)):
        notice(f"the sender gave {rate:.3g} samples a second; --sender-rate {rate:.3g} follows them smoothly")
    if BEYOND in report["events"]:
        unit = "" if isinstance(source, Samples) else ": angles have to be in radians"  # those of a shot are
        notice(f"samples beyond the limits of joints were held at the limits{unit}")
    for path, count in report["unknown_joints"].items():
        notice(f"samples with {path}: {count}; the robot has no such motor, it has {', '.join(robot.joints)}")
    for path, count in report["limited"].items():
        notice(f"{path} was at a limit in {count} commands")
    for path, share in report["too_weak"].items():
        notice(f"{path} needed up to {share:.2f} times the effort that its motor has")
    spent = report["tick_s"]
    notice(f"computing a command took {1e3 * spent['median']:.2f} ms (median; 99%: {1e3 * spent['p99']:.2f} ms)")
