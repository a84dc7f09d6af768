"""What robots that others made cost: `calmotion bench robots FILE ...` makes the two longest links of each flexible.

Each FILE is a USD robot without a shot of ours, such as `calmotion import` writes. Its two longest links that a driven
joint carries become flexible (nylon), all driven joints move for two seconds, as far as their limits allow, and its
last link is the target. The caches of meshes and reductions are empty, kernels are at hand after the first robot, and
no tolerance is asked for. The table has processor seconds by stage, the memory, and the verdict.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from calmotion import ShotError
from calmotion.arrays import Array
from calmotion.model import WORLD, Body, Joint
from calmotion.multibody import span_tree
from calmotion.support import kernel_folder
from calmotion_plugins.robot_import import import_robot

from ..common.reporting import bench_parser, finish, keep, say
from .stages import OPERATORS

SECONDS = 2.0  # length of the motion [s]
TIMES = np.linspace(0.0, SECONDS, round(60.0 * SECONDS) + 1)  # of its frames
TURN = np.radians(40.0)  # of a joint, where its limits allow it
MATERIAL = "nylon"
LINKS = 2
STAGES = ("read", "analyse", "mesh", "reduce", "refine", "search")


@dataclass(frozen=True)
class RobotRow:
    """What a robot cost.

    Attributes:
        robot: Name of its file.
        links: Its flexible links.
        read_s, analyse_s, mesh_s, reduce_s, refine_s, search_s: Processor time of each stage.
        total_s: Of all.
        memory_gb: At most.
        before_mm, after_mm: Largest error as animated, and optimised.
        verdict: Whether the simulation keeps its tolerance, or what went wrong.
    """

    robot: str
    links: str
    read_s: float = np.nan
    analyse_s: float = np.nan
    mesh_s: float = np.nan
    reduce_s: float = np.nan
    refine_s: float = np.nan
    search_s: float = np.nan
    total_s: float = np.nan
    memory_gb: float = np.nan
    before_mm: float = np.nan
    after_mm: float = np.nan
    verdict: str = ""


def measure(file: str, links: int, patience: float) -> RobotRow:
    """The row of a robot; what is wrong with it is its verdict.

    Args:
        file: USD file.
        links: How many of its links become flexible.
        patience: After which it is ended [s].
    """
    name = Path(file).stem
    with tempfile.TemporaryDirectory() as folder:
        try:
            chosen = compose(file, Path(folder) / "shot.usda", links)
        except ShotError as problem:
            return RobotRow(name, "", verdict=str(problem))
        told = ", ".join(path.rpartition("/")[2] for path in chosen)
        command = [sys.executable, "-m", "calmotion", "optimize", f"{folder}/shot.usda", "-o", f"{folder}/calm.usda"]
        environment = dict(os.environ, CALMOTION_CACHE=f"{folder}/cache", NUMBA_CACHE_DIR=str(kernel_folder()))
        try:
            done = subprocess.run(
                [*command, "--json"], capture_output=True, text=True, env=environment, check=False, timeout=patience
            )
            return _row(name, told, json.loads(done.stdout))
        except subprocess.TimeoutExpired:
            return RobotRow(name, told, verdict=f"not ended after {patience:g} s")
        except (json.JSONDecodeError, KeyError):
            said = [line for line in done.stderr.splitlines() if line.startswith("error:")] or [done.stderr[-200:]]
            return RobotRow(name, told, verdict=f"exit status {done.returncode}: {said[0]}")


def _row(name: str, links: str, found: dict[str, Any]) -> RobotRow:
    used = dict.fromkeys(STAGES, 0.0)
    for row in found["operators"]:
        stage = OPERATORS.get(row["operator"], "other")
        used[stage] = used.get(stage, 0.0) + row["processor_s"]
    return RobotRow(
        name,
        links,
        **{f"{stage}_s": used[stage] for stage in STAGES},
        total_s=sum(used.values()),
        memory_gb=found["peak_memory_gb"] or np.nan,
        before_mm=1e3 * found["max_error_before_m"],
        after_mm=1e3 * found["max_error_after_m"],
        verdict="kept" if found["tolerance_kept"] else f"not kept: {found['tolerance_missed_by']}",
    )


def compose(file: str, out: Path, links: int) -> list[str]:
    """Write a shot over a robot, and return the paths of its flexible links.

    Args:
        file: USD file of the robot.
        out: Of the shot.
        links: How many become flexible.

    Raises:
        ShotError: It cannot be read, or no driven joint carries a link with a surface.
    """
    robot = import_robot(file, layer=out).character
    joints = [robot.joints[motor.joint] for motor in robot.motors if motor.optimize]
    carried = {joint.body1 for joint in joints if robot.bodies[joint.body1].surfaces}
    chosen = sorted(carried, key=lambda k: (_length(robot.bodies[k]), robot.bodies[k].path), reverse=True)[:links]
    if not chosen:
        raise ShotError("no driven joint carries a link with a surface", path=file, remedy="Name another robot")
    motion: dict[str, Any] = {"time_s": TIMES} | {joint.name: _swing(joint) for joint in joints}
    np.savez(out.with_suffix(".npz"), **motion)
    tree, depth = span_tree(robot), [0] * (len(robot.bodies) + 1)
    for body, parent in zip(tree.body, tree.parent, strict=True):
        depth[body] = 1 + depth[tree.body[parent] if parent >= 0 else WORLD]
    last = max((joint.body1 for joint in joints), key=lambda k: depth[k])
    names = {k: robot.bodies[k].path.rpartition("/")[2] for k in (*chosen, last)}
    flexible = [f"{names[k]}={MATERIAL}" for k in chosen]
    import_robot(file, layer=out, motion=out.with_suffix(".npz"), flexible=flexible, targets=[names[last]])
    return [robot.bodies[k].path for k in chosen]


def _length(body: Body) -> float:
    """Longest side of the surfaces of a body, to a micrometre [m]."""
    return round(float(np.ptp(np.concatenate([surface.points for surface in body.surfaces]), axis=0).max()), 6)


def _swing(joint: Joint) -> Array:
    """There and back again by a quintic, as far as the limits of a joint allow [rad or m]."""
    low, high = max(joint.lower, -1e3), min(joint.upper, 1e3)
    start = float(np.clip(0.0, low, high))
    move = 0.5 * (high - start if high - start >= start - low else low - start)
    if joint.kind == "revolute":
        move = float(np.clip(move, -TURN, TURN))
    s = np.clip(2.0 * np.abs(TIMES / SECONDS - 0.5) / 0.8, 0.0, 1.0)
    return np.asarray(start + move * (1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s * s)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; returns the exit status."""
    parser = bench_parser("robots", __doc__)
    parser.add_argument("files", metavar="FILE", nargs="+", help="USD file of a robot")
    parser.add_argument("--links", type=int, default=LINKS, help=f"links that become flexible (default: {LINKS})")
    parser.add_argument("--patience", type=float, default=1800.0, help="after which a robot is ended [s]")
    options = parser.parse_args(arguments)
    rows = []
    for file in options.files:
        rows.append(measure(file, options.links, options.patience))
        say(f"{rows[-1].robot}: {rows[-1].total_s:.1f} s, {rows[-1].verdict}")
        keep(options, RobotRow, rows)
    finish(options, "Robots, processor time", rows)
    return 0
