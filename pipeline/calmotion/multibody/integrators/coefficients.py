"""Coefficients of the implicit integrators, by name."""

from __future__ import annotations

from calmotion.multibody.model.system import NEWMARK, Integrator

SPECTRAL_RADIUS = 0.8  # of generalised-alpha at infinite frequency, by default

# Baumgarte's coefficient alpha times the step. Each step leaves a velocity across the joints of about h^2/3 times a
# third derivative of their motion, and gaps of that over alpha: nanometres here. The term is implicit, so that it
# limits no step and does not stiffen the motion; the multipliers of Newmark's family, whose formulas damp them less,
# must not follow positions as closely.
_FIRM, _GENTLE = 1e6, 1e2


def bdf2_integrator(h: float) -> Integrator:
    """BDF2 with step h [s]: second order, damps frequencies that the step does not resolve."""
    return Integrator(velocity=1.5 / h, acceleration=1.5 / h, gamma=1.0, alpha=_FIRM / h, h=h)


def generalized_alpha_integrator(h: float, spectral_radius: float = SPECTRAL_RADIUS) -> Integrator:
    """The generalised-alpha method with step h [s]: second order, damping of high frequencies by choice.

    Args:
        h: Step [s].
        spectral_radius: At infinite frequency, 0 (most damping) to 1 (none). Source: Chung, Hulbert 1993, (25)-(27).
    """
    alpha_m = (2.0 * spectral_radius - 1.0) / (spectral_radius + 1.0)
    alpha_f = spectral_radius / (spectral_radius + 1.0)
    gamma = 0.5 - alpha_m + alpha_f
    return _newmark_family(h, 0.25 * (gamma + 0.5) ** 2, gamma, alpha_m, alpha_f)


def newmark_integrator(h: float) -> Integrator:
    """Newmark's method with step h [s], beta = 1/4 and gamma = 1/2 (the trapezoidal rule): second order, no damping."""
    return _newmark_family(h, 0.25, 0.5, 0.0, 0.0)


def _newmark_family(h: float, beta: float, gamma: float, alpha_m: float, alpha_f: float) -> Integrator:
    return Integrator(
        velocity=gamma / (beta * h), acceleration=(1.0 - alpha_m) / ((1.0 - alpha_f) * gamma * h), gamma=1.0,
        alpha=_GENTLE / h, family=NEWMARK, newmark_beta=beta, newmark_gamma=gamma, alpha_m=alpha_m, alpha_f=alpha_f,
        h=h,
    )  # fmt: skip


IMPLICIT = {"bdf2": bdf2_integrator, "newmark": newmark_integrator, "generalized-alpha": generalized_alpha_integrator}
