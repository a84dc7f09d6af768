"""Rows of one joint: constraints, the forces they transmit, and all derivatives; compiled.

The rows (side i on the parent, j on the component; Q = R_i^T R_j, z the joint axis, theta the motor's angle):

    gamma (p_j' - p_i') + alpha (p_j - p_i)                            3 rows, world axes
    gamma (Q (omega_j - theta' z) - omega_i) + alpha c                 3 rows (weld, motor), parent-side axes
    the x and y rows of it, without theta'                             2 rows (free hinge)
    no more                                                            a ball joint
    none at all                                                        a component that floats freely

On a slider theta is a length: the parent-side marker is moved along its z axis by it, and the rotation is locked; a
free one has no row along its axis (`sliders`). Here
c is the axial vector of the skew part of E = Q R_z(-theta), and (-n_y, n_x), n = Q z, for the hinge. On the
constraint manifold these rows are C_t + C_U T V + alpha C of Seed (31); the multipliers act through exactly the
transpose of their velocity Jacobian, so they do no work there.
"""

from __future__ import annotations

import math

from calmotion.multibody.kernels.markers import fixed_marker, marker_values, marker_velocity_jacobian, moving_marker
from calmotion.multibody.kernels.sliders import (
    LENGTH,
    free_columns,
    free_length,
    free_rows,
    has_row,
    slide,
    slide_velocity_jacobian,
    slides_freely,
)
from calmotion.support.compilation import inlined_kernel, kernel


@kernel
def apply_wrench(n, f, t, sign, m, res):
    """res += sign * (Jp^T f + Jf^T t), f in body axes, t in marker axes."""
    for a in range(n):
        g = 0.0
        for i in range(3):
            g += m.Jp[i, a] * f[i] + m.Jf[i, a] * t[i]
        res[a] += sign * g


@kernel
def _rows_by_multipliers(n, Rb, m, Q, sign, out):
    """out[:, :3] = sign Jp^T Rb^T, out[:, 3:] = sign Jf^T Q^T."""
    for a in range(n):
        for i in range(3):
            g = 0.0
            h = 0.0
            for k in range(3):
                g += m.Jp[k, a] * Rb[i, k]
                h += m.Jf[k, a] * Q[i, k]
            out[a, i] = sign * g
            out[a, 3 + i] = sign * h


@kernel
def joint_kinematics(system, joint, value, rate, c, u, V, w):
    """Values of both markers of a joint at its motor's value and rate, and Q = R_i^T R_j into w.Q.

    Returns:
        The joint's value and rate: its motor's, or the length of a free slider, whose rate its rows do not need.
    """
    p = system.side[joint, 0]
    b = system.side[joint, 1]
    if p < 0 and system.moving[joint] >= 0:
        moving_marker(w.world[system.moving[joint]], w.i)
    elif p < 0:
        fixed_marker(system.position[joint, 0], system.rotation[joint, 0], w.i)
    else:
        marker_values(
            system.elastic[p], system.law[p], system.position[joint, 0], system.rotation[joint, 0],
            system.Phi[joint, 0], system.Psi[joint, 0], c[p], w.R[p], u[p], V[p], w.i,
        )  # fmt: skip
    marker_values(
        system.elastic[b], system.law[b], system.position[joint, 1], system.rotation[joint, 1], system.Phi[joint, 1],
        system.Psi[joint, 1], c[b], w.R[b], u[b], V[b], w.j,
    )  # fmt: skip
    if slides_freely(system, joint):
        value, rate = free_length(w.i, w.j), 0.0
    if system.sliding[joint]:
        slide(value, rate, w.i)
    for i in range(3):
        for k in range(3):
            t = 0.0
            for n in range(3):
                t += w.i.R[n, i] * w.j.R[n, k]
            w.Q[i, k] = t
    return value, rate


@kernel
def _turned_back(Q, angle, E):
    """E = Q R_z(-angle)."""
    cs, sn = math.cos(angle), math.sin(angle)
    for i in range(3):
        E[i, 0] = Q[i, 0] * cs - Q[i, 1] * sn
        E[i, 1] = Q[i, 0] * sn + Q[i, 1] * cs
        E[i, 2] = Q[i, 2]


@inlined_kernel
def constraint_residual(system, joint, angle, rate, scheme, w, gap):
    """Residual of a joint's rows; leaves omega_j - theta' z in w.x, E in w.E, and the unused part of a free slider's
    first three rows, that along its axis, in w.along[0]."""
    hinge = system.rows[joint] == 5 and not system.sliding[joint]
    if system.sliding[joint]:
        angle = 0.0
        rate = 0.0
    for i in range(3):
        gap[i] = scheme.gamma * (w.j.pd[i] - w.i.pd[i]) + scheme.alpha * (w.j.p[i] - w.i.p[i])
        w.x[i] = w.j.w[i]
    if slides_freely(system, joint):
        x, y, z = gap[0], gap[1], gap[2]
        for i in range(2):
            gap[i] = w.i.R[0, i] * x + w.i.R[1, i] * y + w.i.R[2, i] * z
        w.along[0] = w.i.R[0, 2] * x + w.i.R[1, 2] * y + w.i.R[2, 2] * z
        gap[LENGTH] = 0.0
    if not hinge:
        w.x[2] -= rate
    for i in range(3):
        t = 0.0
        for k in range(3):
            t += w.Q[i, k] * w.x[k]
        w.y[i] = t
    if hinge:
        gap[3] = scheme.gamma * (w.y[0] - w.i.w[0]) - scheme.alpha * w.Q[1, 2]
        gap[4] = scheme.gamma * (w.y[1] - w.i.w[1]) + scheme.alpha * w.Q[0, 2]
        gap[5] = 0.0
        return
    _turned_back(w.Q, angle, w.E)
    E = w.E
    gap[3] = scheme.gamma * (w.y[0] - w.i.w[0]) + 0.5 * scheme.alpha * (E[2, 1] - E[1, 2])
    gap[4] = scheme.gamma * (w.y[1] - w.i.w[1]) + 0.5 * scheme.alpha * (E[0, 2] - E[2, 0])
    gap[5] = scheme.gamma * (w.y[2] - w.i.w[2]) + 0.5 * scheme.alpha * (E[1, 0] - E[0, 1])
    if system.rows[joint] <= 3:
        for i in range(system.rows[joint], 6):
            gap[i] = 0.0


@kernel
def _position_rows(n, Rb, m, gamma, alpha, sign, Hv, H):
    """Rows of p' and p: H[:3] = sign Rb (gamma (Gp + Jp Hv) + alpha Jp); Hv, [n, n], maps dX to dV."""
    for a in range(n):
        h0 = gamma * m.Gp[0, a] + alpha * m.Jp[0, a]
        h1 = gamma * m.Gp[1, a] + alpha * m.Jp[1, a]
        h2 = gamma * m.Gp[2, a] + alpha * m.Jp[2, a]
        if a < 3 or a >= 6:
            h0 += gamma * m.Jp[0, a] * Hv[0, 0]
            h1 += gamma * m.Jp[1, a] * Hv[0, 0]
            h2 += gamma * m.Jp[2, a] * Hv[0, 0]
        else:
            for k in range(3):
                h0 += gamma * m.Jp[0, 3 + k] * Hv[1 + k, a - 2]
                h1 += gamma * m.Jp[1, 3 + k] * Hv[1 + k, a - 2]
                h2 += gamma * m.Jp[2, 3 + k] * Hv[1 + k, a - 2]
        for i in range(3):
            H[i, a] = sign * (Rb[i, 0] * h0 + Rb[i, 1] * h1 + Rb[i, 2] * h2)


@kernel
def _rotation_rows(n, m, Hv, A, C, gamma, H):
    """Rows of the angular velocity: H[3:] = gamma A (Gf + Jf Hv) + C Jf."""
    for a in range(n):
        g0 = m.Gf[0, a]
        g1 = m.Gf[1, a]
        g2 = m.Gf[2, a]
        if a >= 6:
            g0 += m.Jf[0, a] * Hv[0, 0]
            g1 += m.Jf[1, a] * Hv[0, 0]
            g2 += m.Jf[2, a] * Hv[0, 0]
        elif a >= 3:
            for k in range(3):
                g0 += m.Jf[0, 3 + k] * Hv[1 + k, a - 2]
                g1 += m.Jf[1, 3 + k] * Hv[1 + k, a - 2]
                g2 += m.Jf[2, 3 + k] * Hv[1 + k, a - 2]
        for i in range(3):
            t = gamma * (A[i, 0] * g0 + A[i, 1] * g1 + A[i, 2] * g2)
            for k in range(3):
                t += C[i, k] * m.Jf[k, a]
            H[3 + i, a] = t


@kernel
def add_skew(A, x, sign, out):
    """out += sign A [x]x."""
    for i in range(3):
        out[i, 0] += sign * (A[i, 1] * x[2] - A[i, 2] * x[1])
        out[i, 1] += sign * (A[i, 2] * x[0] - A[i, 0] * x[2])
        out[i, 2] += sign * (A[i, 0] * x[1] - A[i, 1] * x[0])


@inlined_kernel
def joint_tangent(system, joint, value, rate, scheme, Hv, V, w, blocks):
    """All blocks of a joint; needs `joint_kinematics`, `constraint_residual` and the markers' Jacobians first."""
    p = system.side[joint, 0]
    b = system.side[joint, 1]
    rb = system.elastic[b]
    n = 6 + rb
    sliding, free = system.sliding[joint] != 0, slides_freely(system, joint)
    hinge = system.rows[joint] == 5 and not sliding
    gamma, alpha = scheme.gamma, scheme.alpha
    marker_velocity_jacobian(
        rb, system.law[b], system.rotation[joint, 1], system.Phi[joint, 1], system.Psi[joint, 1], V[b], w.j
    )
    _rows_by_multipliers(n, w.R[b], w.j, w.Q, -1.0, blocks.Lc[joint])
    _position_rows(n, w.R[b], w.j, gamma, alpha, 1.0, Hv[b], blocks.Hc[joint])
    # dc by the turning of side j is M Q, by that of side i -M
    M = w.M
    for i in range(3):
        for k in range(3):
            M[i, k] = 0.0
    if hinge:
        # c = (-n_y, n_x): dc = [n]x-rows of the turning, seen from the parent side
        M[0, 0] = alpha * w.Q[2, 2]
        M[0, 2] = -alpha * w.Q[0, 2]
        M[1, 1] = alpha * w.Q[2, 2]
        M[1, 2] = -alpha * w.Q[1, 2]
    else:
        trace = w.E[0, 0] + w.E[1, 1] + w.E[2, 2]
        for i in range(3):
            for k in range(3):
                M[i, k] = -0.5 * alpha * w.E[i, k]
            M[i, i] += 0.5 * alpha * trace
    # side j: gamma (Q domega_j - Q [x]x dphi_j) + M Q dphi_j
    for i in range(3):
        for k in range(3):
            t = 0.0
            for l in range(3):
                t += M[i, l] * w.Q[l, k]
            w.T[i, k] = t
    add_skew(w.Q, w.x, -gamma, w.T)
    _rotation_rows(n, w.j, Hv[b], w.Q, w.T, gamma, blocks.Hc[joint])
    for i in range(3):
        z = 0.0
        for k in range(3):
            z += M[i, k] * w.Q[k, 2]
        turning = 0.0 if hinge or sliding else 1.0
        blocks.by_angle[joint, 3 + i] = -turning * z
        blocks.by_rate[joint, 3 + i] = -turning * gamma * w.Q[i, 2]
        blocks.by_angle[joint, i] = 0.0
        blocks.by_rate[joint, i] = 0.0
        if sliding:
            # the marker's z axis in the world, and how the marker's turning moves it
            blocks.by_rate[joint, i] = -gamma * w.i.R[i, 2]
            spin = w.i.R[i, 0] * w.i.w[1] - w.i.R[i, 1] * w.i.w[0]
            blocks.by_angle[joint, i] = -alpha * w.i.R[i, 2] - gamma * spin
    if p >= 0:
        rp = system.elastic[p]
        np_ = 6 + rp
        marker_velocity_jacobian(
            rp, system.law[p], system.rotation[joint, 0], system.Phi[joint, 0], system.Psi[joint, 0], V[p], w.i
        )
        if sliding:
            slide_velocity_jacobian(np_, value, rate, w.R[p], w.i)
        for i in range(3):
            for k in range(3):
                w.E[i, k] = 1.0 if i == k else 0.0
                w.T[i, k] = -M[i, k]
        _rows_by_multipliers(np_, w.R[p], w.i, w.E, 1.0, blocks.Lp[joint])
        _position_rows(np_, w.R[p], w.i, gamma, alpha, -1.0, Hv[p], blocks.Hp[joint])
        # side i: gamma ([Q x]x dphi_i - domega_i) - M dphi_i
        add_skew(w.E, w.y, gamma, w.T)
        for i in range(3):
            w.E[i, i] = -1.0
        _rotation_rows(np_, w.i, Hv[p], w.E, w.T, gamma, blocks.Hp[joint])
        for i in range(3):
            for a in range(np_):
                blocks.Jp[joint, i, a] = w.i.Jf[i, a]
    if free:
        _free_slider(system, joint, w, blocks)
        return
    # rows that this joint does not have
    for i in range(6):
        if has_row(system, joint, i):
            continue
        blocks.by_angle[joint, i] = 0.0
        blocks.by_rate[joint, i] = 0.0
        for a in range(n):
            blocks.Lc[joint, a, i] = 0.0
            blocks.Hc[joint, i, a] = 0.0
        if p >= 0:
            for a in range(6 + system.elastic[p]):
                blocks.Lp[joint, a, i] = 0.0
                blocks.Hp[joint, i, a] = 0.0


@inlined_kernel
def _free_slider(system, joint, w, blocks):
    """Blocks of a free slider from those of a driven one at its length."""
    p = system.side[joint, 0]
    b = system.side[joint, 1]
    n = 6 + system.elastic[b]
    by_length = w.y
    for i in range(3):
        by_length[i] = blocks.by_angle[joint, i]
    for i in range(6):
        blocks.by_angle[joint, i] = 0.0
        blocks.by_rate[joint, i] = 0.0
    free_columns(n, w.i.R, blocks.Lc[joint])
    for a in range(n):
        t = 0.0
        for i in range(3):
            z = 0.0
            for k in range(3):
                z += w.i.R[k, 2] * w.R[b, k, i]
            t += z * w.j.Jp[i, a]
        w.length[a] = t
        w.moved[0, a] = 0.0
        w.moved[1, a] = 0.0
    free_rows(n, w.i.R, w.length, w.moved, by_length, blocks.Hc[joint])
    if p < 0:
        return
    n = 6 + system.elastic[p]
    free_columns(n, w.i.R, blocks.Lp[joint])
    # what is left of the gap across the axis, which turns with the marker
    e0, e1 = 0.0, 0.0
    for k in range(3):
        d = w.j.p[k] - w.i.p[k]
        e0 += w.i.R[k, 0] * d
        e1 += w.i.R[k, 1] * d
    r0, r1, r2 = blocks.gap[joint, 0], blocks.gap[joint, 1], w.along[0]
    for a in range(n):
        t = e0 * w.i.Jf[1, a] - e1 * w.i.Jf[0, a]
        for i in range(3):
            z = 0.0
            for k in range(3):
                z += w.i.R[k, 2] * w.R[p, k, i]
            t -= z * w.i.Jp[i, a]
        w.length[a] = t
        w.moved[0, a] = r1 * w.i.Jf[2, a] - r2 * w.i.Jf[1, a]
        w.moved[1, a] = r2 * w.i.Jf[0, a] - r0 * w.i.Jf[2, a]
    free_rows(n, w.i.R, w.length, w.moved, by_length, blocks.Hp[joint])
