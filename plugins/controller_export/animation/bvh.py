"""BVH files: a hierarchy of joints with parallel axes at rest, y up, and Euler angles for each frame."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.support import distinct_names, write_text

from ..commands import LINEAR, Commands, MotorCurves, instants
from .body_poses import body_tree, local_poses, near_turn
from .parallel_frames import (
    ParallelSkeleton,
    euler_angles,
    interpolated_values,
    parallel_skeleton,
)

_PIECES = 4  # lines of a motor for one of its Euler angles
_MOVES = 1e-9  # what a joint that has no position channels may move [m]


@dataclass
class _Joint:
    """A joint of a file: its channels, and their columns."""

    channels: list[str]
    columns: list[int]
    offset: Array = field(default_factory=lambda: np.zeros(3))


def write_bvh(file: str, curves: MotorCurves, rate: float, unit: float, digits: int) -> None:
    """Write the motion, atomically.

    Args:
        file: File to write.
        curves: Of the motors.
        rate: Frames a second [Hz].
        unit: Length of the file's unit [m].
        digits: After the point, of degrees and of lengths.

    Raises:
        OSError: It cannot be written.
        ShotError: The motors do not determine the motion.
    """
    bodies = body_tree(curves)
    skeleton = parallel_skeleton(bodies)
    poses = local_poses(bodies, curves, rate)
    translations, rotations = skeleton.of(poses)
    places = np.round(translations / unit, digits)
    tree, names = bodies.tree, joint_names(skeleton)
    moves = np.ptp(translations, axis=0).max(axis=1) > _MOVES
    columns: list[Array] = []
    alone = sum(parent < 0 for parent in tree.parent) == 1
    lines = ["HIERARCHY"]

    def add(k: int, depth: int, root: bool) -> None:
        order, angles = euler_angles(rotations[k])
        channels = [f"{axis}rotation" for axis in order]
        if root or moves[k]:
            channels = ["Xposition", "Yposition", "Zposition", *channels]
            columns.append(places[:, k])
        columns.append(np.degrees(angles))
        start = np.zeros(3) if root else places[0, k]
        pad = "\t" * depth
        lines.extend(
            [f"{pad}{'ROOT' if root else 'JOINT'} {names[k]}", f"{pad}{{", f"{pad}\tOFFSET {_row(start, digits)}"]
        )
        lines.append(f"{pad}\tCHANNELS {len(channels)} {' '.join(channels)}")
        own = [child for child, parent in enumerate(tree.parent) if parent == k]
        for child in own:
            add(child, depth + 1, False)
        if not own:
            end = _row(_end(skeleton, k) / unit, digits)
            lines.extend([f"{pad}\tEnd Site", f"{pad}\t{{", f"{pad}\t\tOFFSET {end}", f"{pad}\t}}"])
        lines.append(f"{pad}}}")

    roots = [k for k, parent in enumerate(tree.parent) if parent < 0]
    if alone:
        add(roots[0], 0, True)
    else:
        lines += ["ROOT World", "{", "\tOFFSET 0 0 0", "\tCHANNELS 3 Zrotation Xrotation Yrotation"]
        columns.append(np.zeros((len(poses.times), 3)))
        for k in roots:
            add(k, 1, False)
        lines.append("}")
    lines += ["MOTION", f"Frames: {len(poses.times)}", f"Frame Time: {1.0 / rate:.9g}"]
    lines += [_row(row, digits) for row in np.hstack(columns)]
    write_text(file, "\n".join(lines) + "\n")


def read_bvh(file: str, curves: MotorCurves, unit: float) -> Commands:
    """Read the motion as what motors do while a player interpolates the channels by lines.

    Raises:
        ShotError: The file has other joints.
    """
    skeleton = parallel_skeleton(body_tree(curves))
    with open(file, encoding="utf-8") as stream:
        text = stream.read()
    head, _, motion = text.partition("MOTION")
    found = dict(_joints(head))
    numbers = motion.split("\n")
    frame_time = float(next(line for line in numbers if line.startswith("Frame Time:")).split(":")[1])
    rows = np.array([line.split() for line in numbers[3:] if line.strip()], np.float64)
    times = np.arange(len(rows), dtype=np.float64) * frame_time
    names, orders = joint_names(skeleton), []
    translations, angles = np.zeros((len(rows), len(names), 3)), np.zeros((len(rows), len(names), 3))
    for k, name in enumerate(names):
        if name not in found:
            raise ShotError("this file does not hold this robot", path=file, found=f"no joint {name}")
        joint = found[name]
        turns = [n for n, channel in enumerate(joint.channels) if channel.endswith("rotation")]
        shifts = [n for n, channel in enumerate(joint.channels) if channel.endswith("position")]
        orders.append("".join(joint.channels[n][0] for n in turns))
        angles[:, k] = np.radians(rows[:, [joint.columns[n] for n in turns]])
        translations[:, k] = rows[:, [joint.columns[n] for n in shifts]] if shifts else joint.offset
    fine, values = interpolated_values(skeleton, times, unit * translations, orders, angles, _PIECES)
    return Commands(LINEAR, fine, near_turn(values, curves))


def exact_frames(curves: MotorCurves, rate: float) -> Commands:
    """The frames of the curves, interpolated by lines."""
    times = instants(curves, rate, fixed_period=True)
    return Commands(LINEAR, times, curves.at(times))


def joint_names(skeleton: ParallelSkeleton) -> list[str]:
    """A name for each body, without spaces."""
    paths = [body.path for body in skeleton.bodies.bodies]
    short = distinct_names(paths)
    return [re.sub(r"[^\w.-]", "_", short[path]) for path in paths]


def _end(skeleton: ParallelSkeleton, k: int) -> Array:
    """The tip of a body from its joint [m]: its target, else its center of mass."""
    bodies = skeleton.bodies
    own = bodies.tree.body[k]
    for target in bodies.character.targets:
        if target.body == own:
            return skeleton.tip(k, target.frame.position)
    mass = bodies.bodies[k].mass
    return skeleton.tip(k, bodies.pivots[k] if mass is None else mass.center)


def _joints(head: str) -> Iterator[tuple[str, _Joint]]:
    """The joints of a hierarchy by name, with the columns of their channels."""
    name, column, offset = "", 0, np.zeros(3)
    for line in head.splitlines():
        words = line.split()
        if words[:1] in (["ROOT"], ["JOINT"]):
            name = words[1]
        elif words[:1] == ["OFFSET"]:
            offset = np.array(words[1:4], np.float64)
        elif words[:1] == ["CHANNELS"]:
            channels = words[2:]
            yield name, _Joint(channels, list(range(column, column + len(channels))), offset)
            column += len(channels)


def _row(values: Sequence[float] | Array, digits: int) -> str:
    return " ".join(f"{value:.{digits}f}" for value in values)
