"""What the meshes of the model have wrong, and how far it takes the estimates of a robot's parameters.

Noise alone tells a modulus to 0.01%, where the mesh makes a link 0.1% too stiff: the estimate is then off by ten of its
standard deviations. Errors of the stiffness of the links are therefore considered, though not estimated: with the
Jacobian J of the residuals by the parameters z, their weights W and the derivative s by an error of unit variance,

    covariance of z = (J^T W J + E)^-1 + sum_s (K s) (K s)^T,    K = (J^T W J + E)^-1 J^T W

Source: Tapley, Schutz, Born, Statistical Orbit Determination, 2004, section 6.3 (consider covariance).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.multibody import SimulationFailure, in_parallel
from calmotion.reduction import ReducedBody, with_mode_stiffness, with_scaled_stiffness

from .robots import robot_at
from .signals import signals_of

if TYPE_CHECKING:
    from .problem import Calibrated

MODES = 6  # lowest of a link, each of which has an error of its own
OWN = 0.25  # of the error of the mesh: how much the errors of modes differ (beams of two meshes: 0.05 of 0.2%)
SMALL = 0.1  # standard deviation of the errors by which is differentiated


def covariance_of_model(problem: Calibrated, z: Array, jacobian: Array, weights: Array) -> Array:
    """Covariance of z by the errors of the model's meshes, shape [n, n]; zero where these are not known.

    Args:
        problem: The robot, its recordings, and the step.
        z: Where, in standard deviations of the priors.
        jacobian: Derivative of the residuals by z there, shape [N, n].
        weights: Of the residuals, shape [N].
    """
    count = len(problem.parameters)
    gain = np.linalg.inv(jacobian.T @ (weights[:, None] * jacobian) + np.eye(len(z)))
    here = problem.residuals(z)
    found = np.zeros_like(gain)
    if here is None:
        return found

    def residuals(bodies: tuple[ReducedBody, ...]) -> Array | None:
        robot = robot_at(problem.shot.with_bodies(bodies), problem.parameters, z[:count])
        try:
            signals = signals_of(robot, problem.options, problem.after)
        except (ShotError, SimulationFailure):
            return None
        return problem.measurement.residuals(signals, z[count:])

    for other in in_parallel(residuals, list(_softer(problem.shot.bodies))):
        if other is not None:
            off = gain @ (jacobian.T @ (weights * (other - here))) / SMALL
            found += np.outer(off, off)
    return found


def _softer(bodies: tuple[ReducedBody, ...]) -> Iterator[tuple[ReducedBody, ...]]:
    """The bodies with `SMALL` standard deviations of each error: of a link as a whole, and of each of its modes."""
    for index, body in enumerate(bodies):
        size = SMALL * ((body.mesh_error or 0.0) + body.patch_error)
        if not size or not len(body.stiffness):
            continue
        yield _with(bodies, index, with_scaled_stiffness(body, 1.0 - size))
        for mode in np.argsort(body.stiffness)[:MODES]:
            factors = np.ones(len(body.stiffness))
            factors[mode] -= OWN * size
            yield _with(bodies, index, with_mode_stiffness(body, factors))


def _with(bodies: tuple[ReducedBody, ...], index: int, body: ReducedBody) -> tuple[ReducedBody, ...]:
    return (*bodies[:index], body, *bodies[index + 1 :])
