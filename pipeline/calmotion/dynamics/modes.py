"""Natural frequencies of the whole character about a static equilibrium, joints held by their motors."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh, null_space

from ..shot.character import Array
from .kinematics import rigid_state
from .model import Model
from .simulation import Workspace
from .statics import equilibrium, linearize


def system_frequencies(model: Model, joint_angles: Array) -> Array:
    """Undamped natural frequencies [Hz], ascending, about the equilibrium at joint angles of shape [B].

    Motions that the joints forbid are projected out; free joints count as motions. A negative stiffness (an
    unstable pose) gives a frequency of zero.

    Raises:
        SimulationFailure: No equilibrium was found.
    """
    system, workspace = model.system, Workspace.for_system(model.system)
    state, _ = equilibrium(system, rigid_state(model, joint_angles), joint_angles, workspace)
    linearize(system, state, joint_angles, workspace)
    blocks = workspace.blocks
    offset = np.concatenate([[0], np.cumsum(6 + system.elastic)])
    total, count = int(offset[-1]), len(system.parent)
    K, M, H = np.zeros((total, total)), np.zeros((total, total)), np.zeros((6 * count, total))
    for b, p in enumerate(system.parent):
        n = int(6 + system.elastic[b])
        own, rows = slice(offset[b], offset[b] + n), slice(6 * b, 6 * b + 6)
        K[own, own] = blocks.K[b, :n, :n]
        M[own, own] = blocks.D[b, :n, :n]
        H[rows, own] = blocks.Hc[b, :, :n]
        if p >= 0:
            m = int(6 + system.elastic[p])
            parent = slice(offset[p], offset[p] + m)
            K[own, parent] = blocks.Nc[b, :n] @ blocks.Jp[b, :, :m]
            H[rows, parent] = blocks.Hp[b, :, :m]
    allowed = null_space(H)
    if not allowed.shape[1]:
        return np.zeros(0)
    stiffness = allowed.T @ K @ allowed
    # symmetric up to what the moments' axes leave, which vanishes on allowed motions
    values = eigh(0.5 * (stiffness + stiffness.T), allowed.T @ M @ allowed, eigvals_only=True)
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)
