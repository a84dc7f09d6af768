"""Equilibrium poses of a body under loads, in reduced coordinates."""

import numpy as np

from calmotion.arrays import Array
from calmotion.reduction.basis.craig_bampton import Basis

_LARGEST = 0.25  # largest deflection of the poses, of the body's size
_VIBRATION = 0.05  # amplitude of the random displacement that is added
_MODES = 8  # the loads are random sums of the forces that deflect the lowest modes


def stvk_force(gram: Array, u: Array) -> tuple[Array, Array]:
    """Force and stiffness of a St. Venant-Kirchhoff body in reduced coordinates, shapes [r] and [r, r].

    The reference of `multibody.kernels.stvk`: with z = (u, pairs) and J = dz/du, the force is J^T A z.
    """
    r = len(u)
    first, second = np.triu_indices(r)
    pairs = np.arange(len(first))
    z = np.concatenate([u, u[first] * u[second]])
    J = np.zeros((len(z), r))
    J[:r] = np.eye(r)
    np.add.at(J, (r + pairs, first), u[second])
    np.add.at(J, (r + pairs, second), u[first])
    stress = gram @ z
    K = J.T @ gram @ J
    np.add.at(K, (first, second), stress[r:])
    np.add.at(K, (second, first), stress[r:])
    return J.T @ stress, K


def equilibrium(gram: Array, load: Array, start: Array, steps: int = 1, tolerance: float = 1e-9) -> Array:
    """Static equilibrium of a St. Venant-Kirchhoff body under a load, in reduced coordinates, shape [r].

    Newton's method with load stepping; the residual may grow at first, while the stretch relaxes into bending.
    """
    u = start.copy()
    size = max(float(np.abs(load).max()), np.finfo(float).tiny)
    for part in np.linspace(0.0, 1.0, steps + 1)[1:]:
        force, K = stvk_force(gram, u)
        for _ in range(60):
            residual = part * load - force
            if np.abs(residual).max() <= tolerance * size:
                break
            step = np.linalg.solve(K, residual)
            u = u + step
            force, K = stvk_force(gram, u)
    return u


def equilibrium_poses(gram: Array, basis: Basis, count: int, size: float) -> Array:
    """Poses under random loads on the lowest modes, deflections up to `_LARGEST` of the body, shape [count, r]."""
    rng = np.random.default_rng(2008)
    r = len(basis.omega_squared)
    few = min(_MODES, r)
    poses = np.zeros((count, r))
    widest = np.abs(basis.modes).max(axis=(0, 1))
    for k in range(count):
        # softer modes deflect further under similar loads
        direction = rng.normal(size=few) * basis.omega_squared[0] / basis.omega_squared[:few] / widest[:few]
        largest = float(np.abs(basis.modes[:, :, :few] @ direction).max())
        amplitude = _LARGEST * size * (k + 1) / count
        load = np.zeros(r)
        load[:few] = basis.omega_squared[:few] * direction * amplitude / largest
        poses[k] = equilibrium(gram, load, np.zeros(r), steps=4, tolerance=1e-4)
        # and vibration of equal energy in all coordinates
        energy = 0.5 * load @ poses[k]
        poses[k] += _VIBRATION * np.sqrt(energy / basis.omega_squared) * rng.normal(size=r)
    return poses
