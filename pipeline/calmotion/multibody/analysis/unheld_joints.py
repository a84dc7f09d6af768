"""Free joints that neither gravity nor anything else holds where they stand: a carriage on a level rail, a wheel, a rod
that may turn about itself on its ball joint.

A joint carries what lies beyond it, of mass m, with its centre of mass at r from the joint. On a hinge about a the
first and second derivative of its potential are -m g.(a x r) and m (g.r - (g.a)(a.r)), on a slider along d the first is
-m g.d. The joint is neutral where they vanish; a ball joint always is, about the vertical axis.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.model.joint_arrays import rotation_matrix
from calmotion.multibody.model.model import Model, moves_freely, start_angles
from calmotion.multibody.model.topology import chain_members

_SMALL = 1e-6  # stiffness over weight times length that counts as none


def unheld_joints(model: Model, joint_angles: Array, world: Array | None = None) -> list[int]:
    """Joints, by the component that they carry, that move freely and stand in neutral equilibrium in a rigid pose;
    those of closed chains, which hold each other, are left out.

    Args:
        joint_angles: Values of all joints, shape [J]; those of free joints do not matter.
        world: Moving roots, shape [W, 18].
    """
    system, free = model.system, moves_freely(model)[: len(model.system.parent)]
    if not np.any(free):
        return []
    state = rigid_state(model, start_angles(model, joint_angles), world)
    chained = {b for ends in system.side[len(system.parent) :] for b in chain_members(system.parent, ends)}
    R = np.array([rotation_matrix(q) for q in state.q])
    mass, moment = system.mass.copy(), np.einsum("bij,bj->bi", R, system.s) + system.mass[:, None] * state.c
    for b in range(len(mass) - 1, -1, -1):
        if system.parent[b] >= 0:
            mass[system.parent[b]] += mass[b]
            moment[system.parent[b]] += moment[b]
    found, g = [], system.gravity
    for b in map(int, np.flatnonzero(free)):
        axis = R[b] @ system.rotation[b, 1, :, 2]
        weight = mass[b] * float(np.linalg.norm(g))
        if b in chained or system.rows[b] == 0:  # what floats is held by its contacts
            continue
        place = state.c[b] + R[b] @ system.position[b, 1]
        r, scale = moment[b] - mass[b] * place, _SMALL * weight * system.unit[0, 0]
        if system.sliding[b]:
            neutral = abs(mass[b] * (g @ axis)) <= _SMALL * weight
        elif system.rows[b] == 5:
            slope, stiffness = g @ np.cross(axis, r), g @ r - (g @ axis) * (axis @ r)
            neutral = max(abs(slope), abs(stiffness)) <= scale
        else:
            neutral = True
        if neutral:
            found.append(b)
    return found
