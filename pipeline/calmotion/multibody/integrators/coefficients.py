"""Coefficients of the integrators, and the predictor of their steps."""

from calmotion.arrays import Array
from calmotion.multibody.kernels.so3 import turn
from calmotion.multibody.model.system import NEWMARK, Integrator, State, System
from calmotion.support.compilation import kernel, shared_kernel

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


MISSED = 3  # row of a scratch's memory
JUMP = 0.5  # rotation that is missed [rad] by which a motion jumps, and tells nothing about the next step


@kernel
def _moved(h: float, before: State, memory: Array, b: int, i: int) -> float:
    """Change of position i of component b over a step, by Taylor's formula."""
    moved: float = h * (before.V[b, i] + 0.5 * h * memory[0, b, i])
    return moved


@shared_kernel
def predict(system: System, h: float, before: State, now: State, memory: Array) -> None:
    """Positions of the new instant, from the one before and the memory of its step (`Scratch.memory`)."""
    for b in range(len(system.parent)):
        for i in range(3):
            now.c[b, i] = before.c[b, i] + (_moved(h, before, memory, b, i) + memory[MISSED, b, i])
            now.turn[b, i] = _moved(h, before, memory, b, 3 + i) + memory[MISSED, b, 3 + i]
        for j in range(system.elastic[b]):
            now.u[b, j] = before.u[b, j] + (_moved(h, before, memory, b, 6 + j) + memory[MISSED, b, 6 + j])
        turn(before.q[b], now.turn[b], now.q[b])


@shared_kernel
def remember_missed(system: System, h: float, before: State, now: State, memory: Array) -> None:
    """What Taylor's formula missed at the new instant, into the memory, whose accelerations are those before it."""
    largest = 0.0
    for b in range(len(system.parent)):
        for i in range(3):
            memory[MISSED, b, i] = now.c[b, i] - before.c[b, i] - _moved(h, before, memory, b, i)
            missed: float = now.turn[b, i] - _moved(h, before, memory, b, 3 + i)
            memory[MISSED, b, 3 + i] = missed
            largest = max(largest, abs(missed))
        for j in range(system.elastic[b]):
            memory[MISSED, b, 6 + j] = now.u[b, j] - before.u[b, j] - _moved(h, before, memory, b, 6 + j)
    if largest > JUMP:
        memory[MISSED, :, :] = 0.0
