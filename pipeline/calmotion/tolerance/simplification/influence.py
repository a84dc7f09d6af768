"""Which motors can move the targets: those of a rigid robot that do, at some time of the shot."""

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.model import Character
from calmotion.multibody.analysis.rigid_response import RigidResponse
from calmotion.simulation.inputs.curves import coupling_of
from calmotion.simulation.rigid_run import RigidPoses

INSTANTS = 24  # at which the robot is looked at: a motor has no say at all of them only where it never has
NOTHING = 1e-9  # [m/rad], [rad/rad]: rounding


def influence(character: Character, rigid: RigidPoses, motors: IntArray) -> Array:
    """How far each motor moves the targets that count, at most, shape [m] [m/rad].

    A target whose turning counts is as far away as a turn of it weighs: sqrt(weight of rotation / of position) metres,
    one metre where its position does not count.

    Args:
        rigid: The rigid robot in the shot.
        motors: Which motors, with what is geared to them.
    """
    total = len(rigid.joint_angles)
    at = np.unique(np.linspace(0, total - 1, min(INSTANTS, total)).astype(int))
    coupling = coupling_of(character, motors)
    moved = np.flatnonzero(np.any(coupling, axis=1)).astype(np.int32)
    response = RigidResponse.along(
        rigid.model,
        rigid.c[at],
        rigid.q[at],
        rigid.joint_angles[at],
        moved,
        rigid.world[at],
        at * rigid.h,
    )
    found = response.coupled(coupling[moved]).targets
    targets = rigid.model.targets
    positions, rotations = targets.position_weight, targets.rotation_weight
    arm = np.where(positions > 0.0, np.sqrt(rotations / np.where(positions > 0.0, positions, 1.0)), rotations > 0.0)
    reach = np.linalg.norm(found[:, :, :3], axis=2) * (positions > 0.0)[:, None]
    turn = np.linalg.norm(found[:, :, 3:], axis=2) * arm[:, None]
    return np.asarray((reach + turn).max(axis=(0, 1), initial=0.0))
