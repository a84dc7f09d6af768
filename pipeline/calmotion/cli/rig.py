"""`calmotion rig`: a robot out of a skinned character."""

from __future__ import annotations

import argparse
from typing import Any, TextIO

from calmotion import __version__
from calmotion.cli.output import Output, Problem
from calmotion.cli.progress import ProgressDisplay
from calmotion.cli.run import INTERRUPTED, asked_for, carry_out, conclude, problems_of, settings_of, tell_failures
from calmotion.errors import ShotError
from calmotion.host import Run, open_host
from calmotion.shot.outputs import Rig
from calmotion.shot.run import OutputPaths, Source


def rig(args: argparse.Namespace, output: Output) -> int:
    """Make a robot and report what became of each joint; the exit status.

    Raises:
        ShotError: When nothing could be made.
        SettingError: When an option or setting does not fit.
    """
    host = open_host(args.plugins)
    given = [Source(path=args.shot, command="rig"), OutputPaths(layer=args.output)]
    wanted = [Rig, *asked_for(host, args)]
    tell_failures(host, args.quiet)
    with ProgressDisplay(args.quiet, args.progress) as display:
        run = host.run(given, wanted, settings=settings_of(args), progress=display)
        interrupted = carry_out(run, display)
    problems = [Problem(ShotError("interrupted"))] if interrupted else problems_of(run, wanted)
    status = conclude(_report(run), problems, output, None if args.quiet else _print)
    return INTERRUPTED if interrupted else status


def _report(run: Run) -> dict[str, Any]:
    made = run.get(Rig)
    if made is None:
        return {}
    return {
        "command": "rig",
        "version": __version__,
        "layer": made.layer,
        "robot": made.robot,
        "bodies": made.bodies,
        "mass_kg": made.mass,
        "motors": sum(len(joint.motors) for joint in made.joints),
        "max_angle_error_rad": max((joint.off for joint in made.joints), default=0.0),
        "joints": [
            {"joint": j.joint, "body": j.body, "motors": j.motors, "angle_error_rad": j.off} for j in made.joints
        ],
        "targets": made.targets,
    }


def _print(report: dict[str, Any], stream: TextIO) -> None:
    from calmotion.cli.tables import angle, console_on, print_table

    console = console_on(stream)
    rows = [
        [j["joint"].split("/")[-1], j["body"], str(len(j["motors"])), angle(j["angle_error_rad"])]
        for j in report["joints"]
    ]
    print_table(console, "Joints that turn", ["joint", "body", "hinges", "angle they leave"], rows, texts=2)
    console.print(
        f"{report['robot']}: {report['bodies']} bodies, {report['motors']} motors, {report['mass_kg']:.4g} kg; "
        f"the skeleton is followed to {angle(report['max_angle_error_rad'])}",
        markup=False,
        soft_wrap=True,
    )
    for target in report["targets"]:
        console.print(f"target: {target}", markup=False, soft_wrap=True)
    console.print(
        f"{report['layer']} opens as a shot; make links flexible with CalmFlexibleBodyAPI, or "
        "--set rig.skeleton.flexible=all",
        markup=False,
        soft_wrap=True,
    )
