"""The Gauss-Newton matrix of the rigid robot, banded in time: a preconditioner for that of the flexible one."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csr_matrix

from ..dynamics.kinematics import rigid_poses
from ..dynamics.model import Model
from ..shot.character import Array, BoolArray, IntArray
from ..shot.playback import rotation_matrices
from .curves import DEGREE


def rigid_motor_jacobian(model: Model, joint_angles: Array, motors: IntArray, world: Array | None = None) -> Array:
    """Derivative of the rigid targets' frames by motor angles, shape [T, K, 6, len(motors)].

    Rows 0-2: position, world axes [m/rad]; rows 3-5: turning, world axes.
    """
    system, targets = model.system, model.targets
    c, q = rigid_poses(model, joint_angles, world)
    R = rotation_matrices(q)
    column = {int(motor): k for k, motor in enumerate(motors)}
    J = np.zeros((len(joint_angles), len(targets.component), 6, len(motors)))
    for k, own in enumerate(targets.component):
        point = c[:, own] + np.einsum("nij,j->ni", R[:, own], targets.position[k])
        b = int(own)
        while b >= 0:
            motor = int(model.motor[b])
            if motor in column:
                # the joint's frame on the component's side: its z axis is the joint axis
                axis = np.einsum("nij,j->ni", R[:, b], system.rotation[b, 1, :, 2]) * model.sign[b]
                origin = c[:, b] + np.einsum("nij,j->ni", R[:, b], system.position[b, 1])
                if system.sliding[b]:
                    J[:, k, :3, column[motor]] += axis
                else:
                    J[:, k, :3, column[motor]] += np.cross(axis, point - origin)
                    J[:, k, 3:, column[motor]] += axis
            b = int(system.parent[b])
    return J


class RigidPreconditioner:
    """Banded Cholesky factor of `B^T (J^T W J) B + penalty`, unknowns ordered by basis function, then motor."""

    def __init__(self, jacobian: Array, weights: Array, basis: csr_matrix, penalty: csr_matrix):
        """
        Args:
            jacobian: From `rigid_motor_jacobian`, shape [T, K, 6, M].
            weights: Square roots of the residuals' weights, shape [T, K, 6].
            basis: Offset basis at the instants, shape [T, P].
            penalty: Matrix of the regulariser for one motor, shape [P, P].
        """
        weighted = jacobian * weights[..., None]
        metric = np.einsum("nkia,nkib->nab", weighted, weighted)
        motors = metric.shape[1]
        columns = basis.tocsc()
        count = basis.shape[1]
        self._width = (DEGREE + 1) * motors
        banded = np.zeros((self._width, count * motors))
        dense_penalty = penalty.toarray()
        dense = columns.toarray()
        for d in range(DEGREE + 1):
            for i in range(count - d):
                rows = np.flatnonzero(dense[:, i])
                product = dense[rows, i] * dense[rows, i + d]
                block = np.tensordot(product, metric[rows], axes=1) + dense_penalty[i, i + d] * np.eye(motors)
                for a in range(motors):
                    for b in range(motors):
                        row, col = (i + d) * motors + b, i * motors + a
                        if row >= col:
                            banded[row - col, col] = block[a, b]
        self._banded = banded
        self._scale = float(np.max(banded[0]))

    def factor(self, fixed: BoolArray) -> None:
        """Factorise with the unknowns where `fixed` (shape [P * M], bool) is true left out."""
        banded = self._banded.copy()
        for d in range(1, self._width):
            banded[d, : banded.shape[1] - d] *= ~fixed[d:]
        banded[:, fixed] = 0.0
        # directions that no target sees get a floor, so that the factor exists
        banded[0] += 1e-9 * self._scale
        banded[0, fixed] = 1.0
        self._factor = cholesky_banded(banded, lower=True)

    def solve(self, x: Array) -> Array:
        """The factor's inverse applied to a vector of shape [P * M]."""
        return cho_solve_banded((self._factor, True), x)
