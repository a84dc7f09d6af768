"""Cubature of the forces of a Neo-Hookean body in reduced coordinates: few weighted points.

Source: An, Kim, James, Optimizing Cubature for Efficient Integration of Subspace Deformations, 2008: points are
added greedily, weights follow by non-negative least squares over training poses. Two things differ. The part of the
force that is linear in the coordinates is exact (a constant matrix), so the points integrate the nonlinear part only.
The poses are equilibria under random loads, because a random sum of modes stretches a link more than any load does.
"""

import numpy as np
from scipy.optimize import lsq_linear, nnls

from calmotion.arrays import Array, box_diagonal
from calmotion.errors import ShotError
from calmotion.model.character import ElasticMaterial
from calmotion.reduction.basis.craig_bampton import Basis
from calmotion.reduction.elements.assembly import FEModel
from calmotion.reduction.elements.elastic_forms import LAW_ORDER, GradientRule, lame_constants, strain_gram
from calmotion.reduction.material_laws.reduced_poses import equilibrium_poses

# Relative error of the forces over the training poses, each coordinate scaled by its stiffness. Bending forces are
# small differences of large stretch forces: 1e-3 gives an error of 5% in the deflection of a link, this value 0.1%.
ERROR = 2e-5
POSES = 24
_BATCH = 4  # points added between two solutions for the weights
_MOST = 600
_MOST_COORDINATES = 48  # of whose stiffness twice as many entries are matched as there may be points
LEAST_VOLUME = 0.2  # volume ratio below which the logarithm of the law is continued as a parabola
_CANDIDATES = 10_000  # candidate points, a random choice on large meshes


class InaccurateCubature(ShotError):
    """No set of points integrates the energy of a body accurately enough."""


def neohookean_cubature(model: FEModel, basis: Basis, material: ElasticMaterial) -> tuple[Array, int]:
    """The data of `Elasticity` of a Neo-Hookean body, and the number of its points.

    Args:
        model: Full model.
        basis: Modes, modal derivatives included.
        material: Elastic constants.

    Raises:
        InaccurateCubature: No set of points meets `ERROR`.
    """
    r = len(basis.omega_squared)
    if r > _MOST_COORDINATES:
        raise _inaccurate(material, f"{r} elastic coordinates, of which {_MOST_COORDINATES} can be integrated")
    lame, mu = lame_constants(material.youngs_modulus, material.poissons_ratio)
    rule = GradientRule(model.mesh, LAW_ORDER)
    gram = strain_gram(rule, basis.modes, lame, mu)
    poses = equilibrium_poses(gram, basis, POSES, box_diagonal(model.mesh.nodes))
    candidates, columns, target = _training(rule, basis, poses, lame, mu)
    chosen, weights, error = greedy_cubature(columns, target, ERROR, _MOST)
    if error > 10.0 * ERROR:
        raise _inaccurate(material, f"error {error:.2%} with {len(chosen)} points")
    C = linear_tangent(lame, mu)
    points = candidates[chosen]
    correction = np.diag(basis.omega_squared) - np.einsum("c,cmi,mn,cnj->ij", weights, points, C, points, optimize=True)
    correction = 0.5 * (correction + correction.T)
    packed = np.hstack([weights[:, None], points.reshape(len(chosen), -1)])
    return np.concatenate([correction.ravel(), packed.ravel()]), len(chosen)


def _inaccurate(material: ElasticMaterial, found: str) -> InaccurateCubature:
    return InaccurateCubature(
        "no cubature of the Neo-Hookean energy is accurate enough",
        path=material.path,
        attribute="calm:flexible:elasticity",
        found=found,
        remedy="Use stvk, which needs no cubature.",
    )


def _training(rule: GradientRule, basis: Basis, poses: Array, lame: float, mu: float) -> tuple[Array, Array, Array]:
    """Gradients at the candidate points [c, 9, r], the training rows of each of them, and those of the whole body."""
    r = len(basis.omega_squared)
    elements, points = rule.weights.shape
    total = elements * points
    taken = np.arange(total)
    if total > _CANDIDATES:
        taken = np.sort(np.random.default_rng(2008).choice(total, _CANDIDATES, replace=False))
    chunk = max(1, _CANDIDATES // points)
    parts, columns = [], []
    forces = np.zeros(len(poses) * r)
    stiffness = np.zeros(r * (r + 1) // 2)
    for start in range(0, elements, chunk):
        part = slice(start, min(start + chunk, elements))
        G = np.ascontiguousarray(rule.gradients(basis.modes, part).reshape(r, -1, 9).transpose(1, 2, 0))
        volume = rule.weights[part].ravel()
        force, K = _forces(G, poses, basis.omega_squared, lame, mu), _stiffness(G, basis.omega_squared, lame, mu)
        forces += force @ volume
        stiffness += K @ volume
        inside = taken[(taken >= start * points) & (taken < part.stop * points)] - start * points
        parts.append(G[inside])
        columns.append(np.vstack([force[:, inside], K[:, inside]]))
    # all poses have the same weight, whatever their forces
    size = np.linalg.norm(forces.reshape(len(poses), r), axis=1)
    scale = np.concatenate([np.repeat(1.0 / size, r), np.ones(len(stiffness))])
    columns_all = np.hstack(columns)
    columns_all *= scale[:, None]
    return np.concatenate(parts), columns_all, np.concatenate([forces, stiffness]) * scale


def linear_tangent(lame: float, mu: float) -> Array:
    """dP/dF at F = E [Pa], shape [9, 9], row by row."""
    E = np.eye(3)
    C = lame * np.einsum("ij,kl->ijkl", E, E)
    C += mu * (np.einsum("ik,jl->ijkl", E, E) + np.einsum("il,jk->ijkl", E, E))
    return np.asarray(C.reshape(9, 9))


def _forces(G: Array, poses: Array, omega_squared: Array, lame: float, mu: float) -> Array:
    """Reduced force per volume at each point, scaled by the stiffness of each coordinate, shape [poses * r, points]."""
    out = np.empty((len(poses), G.shape[2], len(G)))
    scaled = G / np.sqrt(omega_squared)
    for k, u in enumerate(poses):
        F = (G @ u).reshape(-1, 3, 3) + np.eye(3)
        out[k] = np.einsum("cm,cmi->ic", neohookean_stress(F, lame, mu).reshape(-1, 9), scaled)
    return out.reshape(-1, len(G))


def _stiffness(G: Array, omega_squared: Array, lame: float, mu: float) -> Array:
    """Reduced stiffness per volume about the undeformed state at each point, shape [r (r + 1) / 2, points]."""
    scaled = G / np.sqrt(omega_squared)
    first, second = np.triu_indices(len(omega_squared))
    stress = np.einsum("mn,cni->cmi", linear_tangent(lame, mu), scaled)
    return np.asarray(np.einsum("cmp,cmp->pc", scaled[:, :, first], stress[:, :, second], optimize=True))


def neohookean_stress(F: Array, lame: float, mu: float) -> Array:
    """P = mu F + (lame L - mu) L' cof F [Pa] of deformation gradients, shape [..., 3, 3].

    L = ln J, continued below `LEAST_VOLUME` as its parabola, as in `multibody.kernels.neohookean`.
    """
    rows = np.moveaxis(F, -2, 0)
    cofactor = np.stack([np.cross(rows[(i + 1) % 3], rows[(i + 2) % 3]) for i in range(3)], axis=-2)
    J = np.einsum("...i,...i->...", rows[0], cofactor[..., 0, :])[..., None, None]
    x = (J - LEAST_VOLUME) / LEAST_VOLUME
    flat = J < LEAST_VOLUME
    bounded = np.where(flat, LEAST_VOLUME, J)
    L = np.log(bounded) + np.where(flat, x - 0.5 * x * x, 0.0)
    slope = np.where(flat, (1.0 - x) / LEAST_VOLUME, 1.0 / bounded)
    return np.asarray(mu * F + (lame * L - mu) * slope * cofactor)


def greedy_cubature(columns: Array, target: Array, error: float, most: int) -> tuple[Array, Array, float]:
    """Few columns and non-negative weights such that columns @ weights approximates the target.

    Args:
        columns: Shape [rows, candidates].
        target: Shape [rows].
        error: Error at which to stop, relative to the target.
        most: Largest number of columns.

    Returns:
        Indices of the columns, their weights, and the error reached, relative to the target.
    """
    norm = np.linalg.norm(columns, axis=0)
    norm[norm == 0.0] = np.inf
    chosen: list[int] = []
    weights = np.zeros(0)
    residual = target
    size = float(np.linalg.norm(target))
    if size == 0.0:
        return np.zeros(0, dtype=np.int64), weights, 0.0
    while len(chosen) < most:
        score = (columns.T @ residual) / norm
        score[chosen] = -np.inf
        best = np.argsort(-score)[: min(_BATCH, most - len(chosen))]
        best = best[score[best] > 0.0]
        if not len(best):
            break
        chosen.extend(best.tolist())
        try:
            weights, _ = nnls(columns[:, chosen], target)
        except RuntimeError:  # it does not converge for nearly parallel columns
            weights = lsq_linear(columns[:, chosen], target, (0.0, np.inf), "bvls").x
        used = weights > 0.0
        chosen = [c for c, keep in zip(chosen, used, strict=True) if keep]
        weights = weights[used]
        residual = target - columns[:, chosen] @ weights
        if np.linalg.norm(residual) <= error * size:
            break
    return np.array(chosen, dtype=np.int64), weights, float(np.linalg.norm(residual)) / size
