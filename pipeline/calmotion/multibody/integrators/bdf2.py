"""BDF2 on the rotation group; compiled.

Velocities follow positions by the second-order backward difference; for rotations the difference is taken in the
coordinates of exp around the previous instant, theta_k being the rotation vector from instant k-1 to k:

    omega_n = (3/2 theta_n - 1/2 J_r(theta_n) theta_{n-1}) / h,      q_n = q_{n-1} exp(theta_n)

so that quaternions keep unit length without a constraint (Wieloch, Arnold, BDF integrators for constrained
mechanical systems on Lie groups, 2021). Before the first instant the system rests: positions are continued
backwards as constant, velocities as zero.
"""

from calmotion.arrays import Array
from calmotion.multibody.kernels.so3 import inverse_right_jacobian, right_jacobian, right_jacobian_derivative
from calmotion.multibody.model.system import Instants, System
from calmotion.support.compilation import kernel, shared_kernel


@kernel
def rotation_rate(h: float, turn_now: Array, turn_before: Array, J: Array, omega: Array) -> None:
    """omega_n of the backward difference, shape [3]; J is scratch and holds J_r(theta_n) afterwards."""
    right_jacobian(turn_now, J)
    for i in range(3):
        t = 1.5 * turn_now[i]
        for k in range(3):
            t -= 0.5 * J[i, k] * turn_before[k]
        omega[i] = t / h


@kernel
def rotation_rate_jacobian(h: float, turn_now: Array, turn_before: Array, T: Array, Wt: Array, Hv: Array) -> None:
    """d omega_n / d dphi_n into Hv[1:4, 1:4] and d omega_n / d theta_n into Wt; T holds J_r^-1 afterwards."""
    right_jacobian_derivative(turn_now, turn_before, 1.0, Wt)
    for i in range(3):
        for k in range(3):
            Wt[i, k] *= -0.5 / h
        Wt[i, i] += 1.5 / h
    inverse_right_jacobian(turn_now, T)
    for i in range(3):
        for k in range(3):
            Hv[1 + i, 1 + k] = Wt[i, 0] * T[0, k] + Wt[i, 1] * T[1, k] + Wt[i, 2] * T[2, k]


@shared_kernel
def velocities(system: System, h: float, instants: Instants, J: Array, Vd: Array) -> None:
    """Velocities (into now.V) and accelerations (into Vd, shape [B, N]) of instant n by the backward difference."""
    before2, before, now = instants.before2, instants.before, instants.now
    c1, c2 = 2.0 / h, 0.5 / h
    for b in range(len(system.parent)):
        for i in range(3):
            now.V[b, i] = 3.0 * c2 * now.c[b, i] - c1 * before.c[b, i] + c2 * before2.c[b, i]
        rotation_rate(h, now.turn[b], before.turn[b], J, now.V[b, 3:6])
        for j in range(system.elastic[b]):
            now.V[b, 6 + j] = 3.0 * c2 * now.u[b, j] - c1 * before.u[b, j] + c2 * before2.u[b, j]
        for i in range(6 + system.elastic[b]):
            Vd[b, i] = 3.0 * c2 * now.V[b, i] - c1 * before.V[b, i] + c2 * before2.V[b, i]


@shared_kernel
def position_to_velocity(system: System, h: float, instants: Instants, T: Array, Wt: Array, Hv: Array) -> None:
    """Derivative of the velocity of instant n by its position, into Hv, shape [B, 4, 4]; see `assemble`.

    Args:
        T, Wt: Scratch, shape [3, 3].
    """
    before, now = instants.before, instants.now
    for b in range(len(system.parent)):
        Hv[b, 0, 0] = 1.5 / h
        rotation_rate_jacobian(h, now.turn[b], before.turn[b], T, Wt, Hv[b])
