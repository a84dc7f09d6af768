"""Damping of a flexible body from the ratio of critical damping of its material.

The ratio is measured on a vibrating robot, or on a bar of the material at a similar frequency. A link that carries
other bodies vibrates at a much lower frequency than the same link alone. With the ratio in the modes of the single
link, the robot would have a tenth of it or less. The ratio therefore applies to the modes of the whole character.
"""

from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.model.character import ElasticMaterial
from calmotion.reduction.elements.elastic_forms import GradientRule, lame_constants, linear_stress
from calmotion.reduction.reduced_body import ReducedBody

EXACT_MODES = 6  # lowest modes: two or three bending pairs, or bending and twist
SIGNIFICANT = 0.1  # share of the elastic energy of a mode from which a body takes part in it


def damped(
    body: ReducedBody, material: ElasticMaterial, omega: Array | None = None, shapes: Array | None = None
) -> ReducedBody:
    """The body with the damping of its material.

    A mode in which no other flexible body takes part has exactly the given ratio. Where several bodies take part, each
    is damped separately, and the ratio of the mode is correct within a factor of two. A nonlinear body has the ratio in
    its lowest `EXACT_MODES` modes. Above them modal damping would resist the shortening of a link that bends, which a
    real link does not; Kelvin-Voigt damping, which grows with the frequency, is used there.

    Args:
        body: A flexible body, with any damping.
        material: Its damping ratio, or Rayleigh coefficients, which apply to the single body.
        omega: Angular frequencies of the modes to which the ratio applies, ascending [rad/s], shape [n]; None: those
            of the single body.
        shapes: Elastic coordinates of the body in these mass-normalised modes, shape [r, n].
    """
    nonlinear = body.elasticity is not None
    if material.rayleigh is not None:
        by_mass, retardation = material.rayleigh
        linear = modal_damping(body.stiffness, material)
        damping = np.diag(np.full_like(linear, by_mass) if nonlinear else linear)
    else:
        if omega is None or shapes is None:
            omega, shapes = np.sqrt(np.maximum(body.stiffness, 0.0)), np.eye(len(body.stiffness))
        forces = body.stiffness[:, None] * shapes
        elastic = omega > 1e-9 * omega.max(initial=0.0)
        energy = np.zeros_like(omega)
        energy[elastic] = (shapes * forces).sum(axis=0)[elastic] / omega[elastic] ** 2
        ratio = material.damping_ratio if body.damping_ratio is None else body.damping_ratio
        retardation = _retardation(ratio, omega[energy > SIGNIFICANT]) if nonlinear else 0.0
        missing = np.maximum(2.0 * ratio - retardation * omega[elastic], 0.0)
        damping = (forces[:, elastic] * (missing / omega[elastic] ** 3)) @ forces[:, elastic].T
    if body.elasticity is None:
        return replace(body, damping=damping)
    return replace(body, damping=damping, elasticity=replace(body.elasticity, retardation=retardation))


def ratio_of_parts(mesh: QuadraticMesh, material: ElasticMaterial, modes: Array) -> float | None:
    """Fraction of critical damping of a body of several materials; None where all parts are damped alike.

    Each part is weighted by its share of the strain energy, and the lowest modes by the same.

    Args:
        modes: Ascending, shape [n, 3, r].

    Source: Ungar and Kerwin 1962, Loss factors of viscoelastic systems in terms of energy concepts.
    """
    makeup = None if mesh.filling is None else mesh.filling.makeup
    if makeup is None or makeup.damping is None or not modes.shape[2]:
        return None
    rule = GradientRule(mesh, 2)
    gradients = rule.gradients(modes[:, :, :EXACT_MODES])
    stress = linear_stress(gradients, *lame_constants(material.youngs_modulus, material.poissons_ratio))
    energy = np.einsum("reqij,reqij,eq->re", stress, gradients, rule.weights, optimize=True)
    own = (makeup.moduli * makeup.damping).sum(axis=1) / makeup.moduli.sum(axis=1)
    return float(((energy / energy.sum(axis=1, keepdims=True)) @ own).mean())


def _retardation(ratio: float, omega: Array) -> float:
    """The Kelvin-Voigt coefficient [s] with which the last of the lowest modes has the ratio."""
    if not len(omega):
        return 0.0
    return float(2.0 * ratio / omega[min(EXACT_MODES, len(omega)) - 1])


def modal_damping(omega_squared: Array, material: ElasticMaterial) -> Array:
    """Modal damping of a single body [1/s]: 2 zeta omega, or a + b omega^2 (Rayleigh)."""
    if material.rayleigh is not None:
        a, b = material.rayleigh
        return a + b * omega_squared
    return 2.0 * material.damping_ratio * np.sqrt(np.maximum(omega_squared, 0.0))
