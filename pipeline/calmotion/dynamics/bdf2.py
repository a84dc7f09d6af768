"""BDF2 for the index-2 system, on the rotation group; compiled.

Velocities follow positions by the second-order backward difference; for rotations the difference is taken in the
coordinates of exp around the previous instant, theta_k being the rotation vector from instant k-1 to k:

    omega_n = (3/2 theta_n - 1/2 J_r(theta_n) theta_{n-1}) / h,      q_n = q_{n-1} exp(theta_n)

so that quaternions keep unit length without a constraint (Wieloch, Arnold, BDF integrators for constrained
mechanical systems on Lie groups, 2021). Before the first instant the system rests: positions are continued
backwards as constant, velocities as zero.
"""

from __future__ import annotations

import numpy as np

from ..kernels import kernel
from .assembly import assemble
from .elimination import factor
from .least_multipliers import least_multipliers
from .loops import factor_loops, solve_system
from .so3 import inverse_right_jacobian, right_jacobian, right_jacobian_derivative, turn

CONVERGED, SINGULAR, NOT_CONVERGED = 0, 1, 2


@kernel
def rotation_rate(h, turn_now, turn_before, J, omega):
    """omega_n of the backward difference, shape [3]; J is scratch and holds J_r(theta_n) afterwards."""
    right_jacobian(turn_now, J)
    for i in range(3):
        t = 1.5 * turn_now[i]
        for k in range(3):
            t -= 0.5 * J[i, k] * turn_before[k]
        omega[i] = t / h


@kernel
def rotation_rate_jacobian(h, turn_now, turn_before, J, T, Wt, Hv):
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


@kernel
def velocities(system, h, now, before, before2, J, Vd):
    """Velocities (into now.V) and accelerations (into Vd, shape [B, N]) of instant n by the backward difference."""
    c1, c2 = 2.0 / h, 0.5 / h
    for b in range(len(system.parent)):
        for i in range(3):
            now.V[b, i] = 3.0 * c2 * now.c[b, i] - c1 * before.c[b, i] + c2 * before2.c[b, i]
        rotation_rate(h, now.turn[b], before.turn[b], J, now.V[b, 3:6])
        for j in range(system.elastic[b]):
            now.V[b, 6 + j] = 3.0 * c2 * now.u[b, j] - c1 * before.u[b, j] + c2 * before2.u[b, j]
        for i in range(6 + system.elastic[b]):
            Vd[b, i] = 3.0 * c2 * now.V[b, i] - c1 * before.V[b, i] + c2 * before2.V[b, i]


@kernel
def position_to_velocity(system, h, now, before, J, T, Wt, Hv):
    """How the velocity of instant n follows its position, into Hv, shape [B, 4, 4]; see `assemble`."""
    for b in range(len(system.parent)):
        Hv[b, 0, 0] = 1.5 / h
        rotation_rate_jacobian(h, now.turn[b], before.turn[b], J, T, Wt, Hv[b])


@kernel
def correct(system, before, now, R, x, lam, T):
    """Add a Newton correction (x, shape [B, N], and lam) to a state; returns its largest entry (lengths, angles)."""
    largest = 0.0
    for b in range(len(system.parent)):
        inverse_right_jacobian(now.turn[b], T)
        for i in range(3):
            d = 0.0
            e = 0.0
            for k in range(3):
                d += R[b, i, k] * x[b, k]
                e += T[i, k] * x[b, 3 + k]
            now.c[b, i] += d
            now.turn[b, i] += e
            largest = max(largest, abs(d), abs(e))
        for j in range(system.elastic[b]):
            now.u[b, j] += x[b, 6 + j]
            largest = max(largest, abs(x[b, 6 + j]))
        turn(before.q[b], now.turn[b], now.q[b])
    for j in range(len(system.rows)):
        for i in range(6):
            now.lam[j, i] += lam[j, i]
    return largest


@kernel
def step(system, scheme, h, before2, before, now, angle, rate, tolerance, limit, work, blocks, factors, scratch):
    """One step of BDF2 with Newton's method, from two instants to the next.

    Args:
        before2, before, now: States; `now` is filled, its multipliers start from the previous ones.
        angle, rate: Angle and rate of each joint at the new instant, shape [B].
        tolerance: Largest Newton correction that counts as converged [m, rad]; the iteration is quadratic, so the
            error left is about its square.
        limit: Most iterations.
        scratch: (J, T, Wt, Hv, Vd, x, lam, block, border), see `simulation.allocate_scratch`.

    Returns:
        (code, iterations, component): CONVERGED, or why not and at which component.
    """
    J, T, Wt, Hv, Vd, x, lam, block, border = scratch
    count = len(system.parent)
    joints = len(system.rows)
    for b in range(count):
        for i in range(3):
            now.c[b, i] = 2.0 * before.c[b, i] - before2.c[b, i]
            now.turn[b, i] = before.turn[b, i]
        for j in range(system.elastic[b]):
            now.u[b, j] = 2.0 * before.u[b, j] - before2.u[b, j]
        turn(before.q[b], now.turn[b], now.q[b])
    for j in range(joints):
        for i in range(6):
            now.lam[j, i] = before.lam[j, i]
    for iteration in range(limit):
        velocities(system, h, now, before, before2, J, Vd)
        position_to_velocity(system, h, now, before, J, T, Wt, Hv)
        assemble(system, scheme, now.c, now.q, now.u, now.V, Vd, now.lam, angle, rate, Hv, True, work, blocks)
        bad = factor(system, blocks, factors.lu, factors.pivots, factors.Z)
        if bad >= 0:
            return SINGULAR, iteration + 1, bad
        for b in range(count):
            for i in range(6 + system.elastic[b]):
                x[b, i] = -blocks.res[b, i]
        for j in range(joints):
            for i in range(6):
                lam[j, i] = -blocks.gap[j, i]
        if joints > count:
            factor_loops(
                system, blocks.Lc, blocks.Lp, blocks.Hc[count:], blocks.Hp, blocks.Nc, blocks.Jp, factors.lu,
                factors.pivots, factors.Z, border, block,
            )  # fmt: skip
        solve_system(
            system, blocks.Lc, blocks.Lp, blocks.Hc[count:], blocks.Hp, blocks.Nc, blocks.Jp, factors.lu,
            factors.pivots, factors.Z, border.inverse, x, lam, border.X, border.lam, border.y, border.x, block,
        )  # fmt: skip
        largest = correct(system, before, now, work.R, x, lam, T)
        if not (largest < 1e3):
            return NOT_CONVERGED, iteration + 1, _worst(system, x)
        if largest < tolerance:
            velocities(system, h, now, before, before2, J, Vd)
            if joints > count:
                least_multipliers(system, border, now.lam)
            return CONVERGED, iteration + 1, -1
    return NOT_CONVERGED, limit, _worst(system, x)


@kernel
def _worst(system, x):
    """Component with the largest (or a non-finite) correction."""
    worst = 0
    big = -1.0
    for b in range(len(system.parent)):
        for i in range(6 + system.elastic[b]):
            t = abs(x[b, i])
            if not np.isfinite(t):
                return b
            if t > big:
                big = t
                worst = b
    return worst
