"""Errors at the targets as a least-squares objective, formulation, section 3."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.model import WeightTrack
from calmotion.multibody.analysis.kinematics import of_components, of_targets, target_jacobians
from calmotion.multibody.kernels.so3 import inverse_right_jacobian, logarithm, matrix_of
from calmotion.multibody.model.model import Model
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.support.compilation import allocating_kernel


@allocating_kernel
def _rotation_errors(reference: Array, actual: Array, errors: Array, inverse: Array) -> None:
    """Rotation vector of R_ref^T R, and J_r^-1 of it, for quaternions of shape [T, K, 4]."""
    A = np.zeros((3, 3))
    B = np.zeros((3, 3))
    E = np.zeros((3, 3))
    for n in range(reference.shape[0]):
        for k in range(reference.shape[1]):
            matrix_of(reference[n, k], A)
            matrix_of(actual[n, k], B)
            for i in range(3):
                for j in range(3):
                    E[i, j] = A[0, i] * B[0, j] + A[1, i] * B[1, j] + A[2, i] * B[2, j]
            logarithm(E, errors[n, k])
            inverse_right_jacobian(errors[n, k], inverse[n, k])


def rotation_errors(reference: Array, actual: Array) -> tuple[Array, Array]:
    """Rotation vectors [rad] from reference to actual, shape [T, K, 3], and their inverse right Jacobians."""
    shape = reference.shape[:2]
    errors, inverse = np.zeros(shape + (3,)), np.zeros(shape + (3, 3))
    _rotation_errors(reference, actual, errors, inverse)
    return errors, inverse


@dataclass(frozen=True, eq=False)
class IntendedMotion:
    """The intended motion of T steps: body poses by component, and targets, world axes.

    Attributes:
        c, q: Origins [m] and quaternions of the components, shapes [T, B, 3] and [T, B, 4].
        target_positions, target_rotations: [m] and quaternions, shapes [T, K, 3] and [T, K, 4].
    """

    c: Array
    q: Array
    target_positions: Array
    target_rotations: Array


@dataclass(frozen=True, eq=False)
class Objective:
    """G = 1/2 int sum_k ( w_k |x_k - x^_k|^2 + w'_k |log(R^_k^T R_k)|^2 ) dt over the judged time.

    Attributes:
        model: The model that has the targets.
        intended: Their intended motion.
        weights: Square roots of weight times step, shape [T, K, 6]; zero where nothing is judged.
    """

    model: Model
    intended: IntendedMotion
    weights: Array

    @classmethod
    def over(
        cls, model: Model, intended: IntendedMotion, grid: TimeGrid, changing: Sequence[WeightTrack] = ()
    ) -> Objective:
        """The objective with the model's weights, judged from time 0 on (the pre-roll is not).

        Args:
            changing: Weights that change in time, instead of the model's.
        """
        t, times = model.targets, grid.times
        weights = np.empty((len(times), len(t.component), 2))
        weights[:] = np.stack([t.position_weight, t.rotation_weight], axis=1)
        for track in changing:
            weights[:, track.target, int(track.rotation)] = np.interp(times, track.times, track.values)
        return cls(model, intended, np.sqrt(grid.quadrature[:, None, None] * np.repeat(weights, 3, axis=2)))

    def residuals(self, positions: Array, rotations: Array) -> tuple[Array, Array]:
        """Weighted residuals, shape [T, K, 6], and the inverse right Jacobians of the rotation errors."""
        turned, inverse = rotation_errors(self.intended.target_rotations, rotations)
        errors = np.concatenate([positions - self.intended.target_positions, turned], axis=2)
        return self.weights * errors, inverse

    def jacobian(self, c: Array, q: Array, u: Array, inverse: Array) -> Array:
        """Weighted residuals by their component's coordinates, shape [T, K, 6, N]."""
        J = target_jacobians(self.model, c, q, u)
        J[:, :, 3:] = inverse @ J[:, :, 3:]
        J *= self.weights[..., None]
        return J

    def scatter(self, J: Array, residuals: Array) -> Array:
        """J^T residuals, gathered by component, shape [T, B, N]."""
        return of_components(self.model, J, residuals)

    def gather(self, J: Array, motion: Array) -> Array:
        """J times a change of the components' coordinates of shape [T, B, N], shape [T, K, 6]."""
        return of_targets(self.model, J, motion)
