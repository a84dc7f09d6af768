"""Closed loops: how many rows of their joints are redundant, and which joints hold nothing that others do not."""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.model.phases import without_contacts
from calmotion.multibody.model.system import allocate_state
from calmotion.multibody.statics.equilibrium import linearize
from calmotion.simulation.rigid_run import RigidPoses

INSTANTS = 5  # at which the robot is looked at
RANK = 1e-8  # of the largest singular value, below which one is zero


@dataclass(frozen=True)
class Closures:
    """The closed loops of a rigid robot.

    Attributes:
        joints: Joints of the system that close a loop, from `len(parent)` on.
        redundant_rows: Rows that others imply, at every instant looked at.
        redundant: Those of the joints all of whose rows the joints that are kept imply.
    """

    joints: tuple[int, ...] = ()
    redundant_rows: int = 0
    redundant: tuple[int, ...] = ()


def closures_of(rigid: RigidPoses) -> Closures:
    """The closed loops of a robot in a motion.

    Args:
        rigid: The rigid robot in the shot; motors count as rows.
    """
    system, total = rigid.model.system, len(rigid.joint_angles)
    count = len(system.parent)
    loops = [joint for joint in range(count, len(system.rows)) if not system.contact[joint]]
    if not loops:
        return Closures()
    at = np.unique(np.linspace(0, total - 1, min(INSTANTS, total)).astype(int))
    rows = [_rows(rigid, n) for n in at]
    ranks = [_rank(by_joint) for by_joint in rows]  # that leaving out what is redundant does not change
    spare = min(sum(map(len, by_joint)) - rank for by_joint, rank in zip(rows, ranks, strict=True))
    redundant: list[int] = []
    for joint in reversed(loops):
        if rigid.model.motor[joint] >= 0:
            continue  # its motor's effort is of interest
        without = {joint, *redundant}
        rest = [[r for j, r in enumerate(by_joint) if j not in without] for by_joint in rows]
        if [_rank(by_joint) for by_joint in rest] == ranks:
            redundant.append(joint)
    return Closures(tuple(loops), spare, tuple(sorted(redundant)))


def _rows(rigid: RigidPoses, n: int) -> list[Array]:
    """Constraint rows of every joint at an instant by all coordinates, lengths in units of the robot's size."""
    system = without_contacts(rigid.model.system)  # which come and go
    ws, state = Workspace.for_system(system), allocate_state(system)
    state.c[:], state.q[:], ws.work.world[:] = rigid.c[n], rigid.q[n], rigid.world[n]
    linearize(system, state, rigid.joint_angles[n], ws)
    size = max(float(np.abs(system.position).max()), 1e-9)
    found = []
    for joint, (parent, body) in enumerate(system.side):
        block = np.zeros((6, len(system.parent), 6))
        block[:, body] = ws.blocks.Hc[joint, :, :6]
        if parent >= 0:
            block[:, parent] += ws.blocks.Hp[joint, :, :6]
        block[:3] /= size
        block[:, :, :3] *= size
        flat = block.reshape(6, -1)
        found.append(flat[[i for i in range(6) if has_row(system, joint, i)]])
    return found


def _rank(rows: list[Array]) -> int:
    stacked = np.concatenate(rows)
    if not stacked.size:
        return 0
    values = np.linalg.svd(stacked, compute_uv=False)
    return int(np.sum(values > RANK * values[0]))
