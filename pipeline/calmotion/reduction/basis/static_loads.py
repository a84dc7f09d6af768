"""Static loads of a body: inertial forces in an accelerated frame, and wrenches on its interfaces."""

import numpy as np

from calmotion.arrays import Array
from calmotion.reduction.load_envelope import LoadEnvelope

ACCELERATIONS = 12  # leading entries of `peak_loads`, before those of wrenches
OVERSHOOT = 2.0  # deflection by a sudden load over the static one
UNIFORM = 6  # the first six unit accelerations are those of a frame that starts from rest
_PAIRS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


def unit_accelerations(nodes: Array) -> Array:
    """Acceleration fields of a rigid body: of the origin, angular, and centripetal.

    Args:
        nodes: [m], shape [n, 3], from the origin of the frame.

    Returns:
        Shape [n, 3, 12]: unit acceleration along each axis, unit angular acceleration about each axis (alpha x X),
        and omega x (omega x X) by the products omega_i omega_j, (i, j) = 00, 11, 22, 12, 02, 01.
    """
    fields = np.zeros((len(nodes), 3, 12))
    fields[:, :, :3] = np.eye(3)
    for axis in range(3):
        fields[:, :, 3 + axis] = np.cross(np.eye(3)[axis], nodes)
    for k, (i, j) in enumerate(_PAIRS):
        product = np.zeros((3, 3))
        product[i, j] = product[j, i] = 1.0
        if i == j:
            product -= np.eye(3)
        fields[:, :, 6 + k] = nodes @ product
    return fields


def peak_loads(load_envelope: LoadEnvelope) -> Array:
    """Peaks of the twelve unit accelerations, then of the six wrench components of each patch, shape [12 + 6 p]."""
    omega = np.abs(load_envelope.angular_velocity)
    products = [omega[i] * omega[j] for i, j in _PAIRS]
    wrenches = np.hstack([load_envelope.force, load_envelope.moment]).ravel()
    accelerations = np.concatenate([load_envelope.acceleration, load_envelope.angular_acceleration, products])
    return np.asarray(np.abs(np.concatenate([accelerations, wrenches])))
