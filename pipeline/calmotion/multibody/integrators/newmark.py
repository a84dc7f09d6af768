"""Newmark's formulas and the generalised-alpha method on the rotation group; compiled.

With a the acceleration of the method and D the change of position over the step (c_n - c_{n-1}, the rotation vector
theta_n in body axes, u_n - u_{n-1}):

    a_n = (D - h V_{n-1}) / (beta h^2) - (1/(2 beta) - 1) a_{n-1}
    V_n = V_{n-1} + h ((1 - gamma) a_{n-1} + gamma a_n)
    (1 - alpha_f) V'_n + alpha_f V'_{n-1} = (1 - alpha_m) a_n + alpha_m a_{n-1}

where V' is the acceleration in the equations of motion. alpha_m = alpha_f = 0 is Newmark's method. Source: Chung,
Hulbert, A time integration algorithm for structural dynamics, 1993; Bruels, Cardona, On the use of Lie group time
integrators in multibody dynamics, 2010.
"""

from calmotion.arrays import Array
from calmotion.multibody.kernels.so3 import inverse_right_jacobian
from calmotion.multibody.model.system import Instants, Integrator, State, System
from calmotion.support.compilation import kernel


@kernel
def velocities(system: System, integrator: Integrator, instants: Instants, memory: Array, Vd: Array) -> None:
    """Velocities (into now.V) and accelerations (into Vd, shape [B, N]) of instant n.

    Args:
        memory: V' and a of the instant before, and room for a of this one, shape [3, B, N].
    """
    before, now = instants.before, instants.now
    h, beta, gamma = integrator.h, integrator.newmark_beta, integrator.newmark_gamma
    alpha_m, alpha_f = integrator.alpha_m, integrator.alpha_f
    rest = 1.0 / (1.0 - alpha_f)
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            if i < 3:
                D = now.c[b, i] - before.c[b, i]
            elif i < 6:
                D = now.turn[b, i - 3]
            else:
                D = now.u[b, i - 6] - before.u[b, i - 6]
            old = memory[1, b, i]
            a = (D - h * before.V[b, i]) / (beta * h * h) - (0.5 / beta - 1.0) * old
            now.V[b, i] = before.V[b, i] + h * ((1.0 - gamma) * old + gamma * a)
            Vd[b, i] = rest * ((1.0 - alpha_m) * a + alpha_m * old - alpha_f * memory[0, b, i])
            memory[2, b, i] = a


@kernel
def position_to_velocity(system: System, integrator: Integrator, now: State, T: Array, Hv: Array) -> None:
    """Derivative of the velocity of instant n by its position, into Hv, shape [B, 4, 4]; see `assemble`."""
    rate = integrator.newmark_gamma / (integrator.newmark_beta * integrator.h)
    for b in range(len(system.parent)):
        Hv[b, 0, 0] = rate
        inverse_right_jacobian(now.turn[b], T)
        for i in range(3):
            for k in range(3):
                Hv[b, 1 + i, 1 + k] = rate * T[i, k]
