"""Damping of a flexible body, from the ratio of critical damping that is known of its material.

A ratio is measured on a robot that vibrates, or on a bar of the plastic at about such a frequency. A link that carries
others vibrates far more slowly with them than it would alone; were the ratio given to its modes alone, the robot would
have a tenth of it or less. So it is given to the modes of the whole character.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calmotion.reduction.reduced_body import ReducedBody
from calmotion.shot.character import Array, ElasticMaterial

EXACT_MODES = 6  # of the lowest: two or three bending pairs, or bending and twist
TAKES_PART = 0.1  # of a mode's elastic energy, that makes it one of the body


def damped(
    body: ReducedBody, material: ElasticMaterial, omega: Array | None = None, shapes: Array | None = None
) -> ReducedBody:
    """The body with the damping of its material.

    A ratio of critical damping is met exactly by modes in which no other flexible body takes part. Where several do,
    each resists by itself, and the mode has about the ratio, within a factor of two. A nonlinear body has it in its
    lowest modes, `EXACT_MODES`; above them, where modal damping would resist the shortening of a link as it
    bends, which costs a real one nothing, it has Kelvin-Voigt damping, which grows with the frequency.

    Args:
        body: A flexible body, with any damping.
        material: Its ratio, or Rayleigh coefficients, which are of the body by itself.
        omega: Angular frequencies of the modes that are to have the ratio, ascending [rad/s], shape [n]; None: those
            of the body by itself.
        shapes: Its elastic coordinates in these modes, which have mass one, shape [r, n].
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
        lasting = omega > 1e-9 * omega.max(initial=0.0)
        energy = np.zeros_like(omega)
        energy[lasting] = (shapes * forces).sum(axis=0)[lasting] / omega[lasting] ** 2
        retardation = _retardation(material.damping_ratio, omega[energy > TAKES_PART]) if nonlinear else 0.0
        missing = np.maximum(2.0 * material.damping_ratio - retardation * omega[lasting], 0.0)
        damping = (forces[:, lasting] * (missing / omega[lasting] ** 3)) @ forces[:, lasting].T
    if body.elasticity is None:
        return replace(body, damping=damping)
    return replace(body, damping=damping, elasticity=replace(body.elasticity, retardation=retardation))


def _retardation(ratio: float, omega: Array) -> float:
    """The Kelvin-Voigt coefficient [s] that gives the last of the lowest modes its ratio."""
    if not len(omega):
        return 0.0
    return float(2.0 * ratio / omega[min(EXACT_MODES, len(omega)) - 1])


def modal_damping(omega_squared: Array, material: ElasticMaterial) -> Array:
    """Diagonal of the damping of a body by itself in its modes [1/s]: 2 zeta omega, or a + b omega^2 (Rayleigh)."""
    if material.rayleigh is not None:
        a, b = material.rayleigh
        return a + b * omega_squared
    return 2.0 * material.damping_ratio * np.sqrt(np.maximum(omega_squared, 0.0))
