"""What the meshes of the model have wrong, and how far it takes the estimates of a robot's parameters.

Noise alone tells a modulus to 0.01%, where the mesh makes a link 0.1% too stiff: the estimate is then off by ten of its
standard deviations. Errors of the stiffness of the links are therefore considered, though not estimated: with the
Jacobian J of the residuals by the parameters z, their weights W and the derivative s by an error of unit variance,

    covariance of z = (J^T W J + E)^-1 + sum_s (K s) (K s)^T,    K = (J^T W J + E)^-1 J^T W

Source: Tapley, Schutz, Born, Statistical Orbit Determination, 2004, section 6.3 (consider covariance).
"""

from collections.abc import Callable

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.multibody import SimulationFailure, in_parallel
from calmotion.reduction import ReducedBody, with_mode_stiffness, with_scaled_stiffness

from .problem import Calibrated

MODES = 6  # lowest of a link, each of which has an error of its own
OWN = 0.25  # of the error of the mesh: how much the errors of modes differ (beams of two meshes: 0.05 of 0.2%)
SMALL = 0.1  # standard deviation of the errors by which is differentiated


def covariance_of_model(
    problem: Calibrated, z: Array, jacobian: Array, weights: Array, of: Callable[[Array], Array] = lambda values: values
) -> Array:
    """Covariance of z by the errors of the model's meshes, shape [n, n]; zero where these are not known.

    Args:
        problem: The robot, its recordings, and the step.
        z: Where, in standard deviations of the priors.
        jacobian: Derivative of the residuals by z there, shape [N, n].
        weights: Of the residuals, shape [N].
        of: What is done to residuals before they are weighed.
    """
    count = len(problem.parameters)
    gain = np.linalg.inv(jacobian.T @ (weights[:, None] * jacobian) + np.eye(len(z)))
    here = problem.residuals(z)
    found = np.zeros_like(gain)
    if here is None:
        return found

    def residuals(error: tuple[int, int]) -> Array | None:
        try:
            shots = [take.shot.with_bodies(_softer(take.shot.bodies, *error)) for take in problem.takes]
            motions = problem.simulated(z[:count], shots)
        except (ShotError, SimulationFailure):
            return None
        return problem.measurement.residuals(motions, z[count:])

    for other in in_parallel(residuals, _errors(problem.shot.bodies)):
        if other is not None:
            off = gain @ (jacobian.T @ (weights * of(other - here))) / SMALL
            found += np.outer(off, off)
    return found


def _errors(bodies: tuple[ReducedBody, ...]) -> list[tuple[int, int]]:
    """Errors of a link as a whole, and of each of its lowest modes: the body, and -1 or the place of the mode."""
    found = []
    for index, body in enumerate(bodies):
        if _size(body) and len(body.stiffness):
            found += [(index, rank) for rank in range(-1, min(MODES, len(body.stiffness)))]
    return found


def _softer(bodies: tuple[ReducedBody, ...], index: int, rank: int) -> tuple[ReducedBody, ...]:
    """The bodies with `SMALL` standard deviations of an error."""
    body = bodies[index]
    size = SMALL * _size(body)
    if rank < 0:
        other = with_scaled_stiffness(body, 1.0 - size)
    else:
        factors = np.ones(len(body.stiffness))
        factors[np.argsort(body.stiffness)[rank : rank + 1]] -= OWN * size
        other = with_mode_stiffness(body, factors)
    return (*bodies[:index], other, *bodies[index + 1 :])


def _size(body: ReducedBody) -> float:
    """Relative error of the stiffness of a link."""
    return body.mesh_error or 0.0
