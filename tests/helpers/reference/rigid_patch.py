"""Statics of a full mesh, part of whose nodes move as one rigid body: what a link does between two hard neighbours."""

import numpy as np
from full_order import FullOrder
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu
from scipy.spatial.transform import Rotation


def pull(full: FullOrder, held, patch, center, force, steps=2):
    """Displacement of a patch's center [m] and rotation vector of the patch, in balance with a force [N] there.

    Args:
        held, patch: Nodes that stay, and nodes that move as a rigid body.
    """
    n, patch, center = len(full.nodes), np.asarray(patch), np.asarray(center, dtype=float)
    inside = np.ones(n, dtype=bool)
    inside[held], inside[patch] = False, False
    inside = np.flatnonzero(np.repeat(inside, 3))
    rows = (3 * patch[:, None] + np.arange(3)).ravel()
    arms, k = full.nodes[patch] - center, len(inside)
    x, moved, turn = full.nodes.copy(), np.zeros(3), Rotation.identity()
    for part in np.linspace(0.0, 1.0, steps + 1)[1:]:
        for _ in range(40):
            f, K = full.forces(x)
            turned = turn.apply(arms)
            rigid = np.zeros((len(patch), 3, 6))
            rigid[:, :, :3] = np.eye(3)
            rigid[:, :, 3:] = -_cross(turned)
            values = np.concatenate([np.ones(k), rigid.ravel()])
            row, column = np.repeat(rows, 6), np.tile(k + np.arange(6), len(rows))
            row, column = np.concatenate([inside, row]), np.concatenate([np.arange(k), column])
            B = coo_matrix((values, (row, column)), shape=(3 * n, k + 6)).tocsr()
            residual = -(B.T @ f)
            residual[k : k + 3] += part * np.asarray(force)
            tangent = (B.T @ K @ B).tolil()
            # the forces on the patch turn with it
            geometric = np.einsum("nij,njk->ik", _cross(f.reshape(-1, 3)[patch]), _cross(turned))
            tangent[k + 3 :, k + 3 :] = tangent[k + 3 :, k + 3 :].toarray() + geometric
            step = splu(tangent.tocsc()).solve(residual)
            x.reshape(-1)[inside] += step[:k]
            moved, turn = moved + step[k : k + 3], Rotation.from_rotvec(step[k + 3 :]) * turn
            x[patch] = center + moved + turn.apply(arms)
            if np.abs(step).max() < 1e-11:
                break
        else:
            raise ArithmeticError(f"no balance at {part:.0%} of the load; take more steps")
    return moved, turn.as_rotvec()


def _cross(vectors):
    """[a]x of each vector, shape [n, 3, 3]."""
    return np.cross(vectors[:, None, :], np.eye(3)).swapaxes(1, 2)
