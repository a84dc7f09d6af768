"""Derivatives of a joint's constraint rows and of the forces through it; compiled. See `joints` for the rows."""

from calmotion.arrays import Array
from calmotion.multibody.kernels.components import marker_of
from calmotion.multibody.kernels.joints import add_skew, firmness, is_hinge
from calmotion.multibody.kernels.markers import MarkerWork, marker_velocity_jacobian
from calmotion.multibody.kernels.sliders import free_columns, free_rows, has_row, slide_velocity_jacobian, slides_freely
from calmotion.multibody.kernels.work import Work
from calmotion.multibody.model.system import Blocks, Integrator, System
from calmotion.support.compilation import inlined_kernel, kernel, shared_kernel


@kernel
def _rows_by_multipliers(n: int, Rb: Array, m: MarkerWork, Q: Array, sign: float, out: Array) -> None:
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
def _position_rows(
    n: int, Rb: Array, m: MarkerWork, gamma: float, alpha: float, sign: float, Hv: Array, H: Array
) -> None:
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
def _rotation_rows(n: int, m: MarkerWork, Hv: Array, A: Array, C: Array, gamma: float, H: Array) -> None:
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
def _rotation_constraint_jacobian(hinge: bool, alpha: float, Q: Array, E: Array, M: Array) -> None:
    """M with alpha dc = M Q dphi_j - M dphi_i, shape [3, 3]."""
    for i in range(3):
        for k in range(3):
            M[i, k] = 0.0
    if hinge:
        # c = (-n_y, n_x): dc = [n]x-rows of the rotation, in parent-side axes
        M[0, 0] = alpha * Q[2, 2]
        M[0, 2] = -alpha * Q[0, 2]
        M[1, 1] = alpha * Q[2, 2]
        M[1, 2] = -alpha * Q[1, 2]
    else:
        trace = E[0, 0] + E[1, 1] + E[2, 2]
        for i in range(3):
            for k in range(3):
                M[i, k] = -0.5 * alpha * E[i, k]
            M[i, i] += 0.5 * alpha * trace


@inlined_kernel
def _component_rows(
    system: System, joint: int, integrator: Integrator, Hv: Array, V: Array, w: Work, blocks: Blocks
) -> None:
    """Lc and Hc: the joint's columns and rows of the component on side 1; leaves M in the scratch."""
    b = system.side[joint, 1]
    n = 6 + system.elastic[b]
    gamma, alpha, M = integrator.gamma, firmness(system, joint, integrator), w.M
    marker_velocity_jacobian(marker_of(system, joint, 1), V[b], w.j)
    _rows_by_multipliers(n, w.R[b], w.j, w.Q, -1.0, blocks.Lc[joint])
    _position_rows(n, w.R[b], w.j, gamma, alpha, 1.0, Hv[b], blocks.Hc[joint])
    _rotation_constraint_jacobian(is_hinge(system, joint), alpha, w.Q, w.E, M)
    # gamma (Q domega_j - Q [x]x dphi_j) + M Q dphi_j
    for i in range(3):
        for k in range(3):
            t = 0.0
            for l in range(3):
                t += M[i, l] * w.Q[l, k]
            w.T[i, k] = t
    add_skew(w.Q, w.x, -gamma, w.T)
    _rotation_rows(n, w.j, Hv[b], w.Q, w.T, gamma, blocks.Hc[joint])


@inlined_kernel
def _rows_by_motor(system: System, joint: int, integrator: Integrator, w: Work, blocks: Blocks) -> None:
    """by_angle and by_rate: the joint's rows by its motor; needs `_component_rows` first."""
    sliding = system.sliding[joint] != 0
    gamma, alpha = integrator.gamma, integrator.alpha
    for i in range(3):
        z = 0.0
        for k in range(3):
            z += w.M[i, k] * w.Q[k, 2]
        rotating = 0.0 if sliding or is_hinge(system, joint) else 1.0
        blocks.by_angle[joint, 3 + i] = -rotating * z
        blocks.by_rate[joint, 3 + i] = -rotating * gamma * w.Q[i, 2]
        blocks.by_angle[joint, i] = 0.0
        blocks.by_rate[joint, i] = 0.0
        if sliding:
            # the marker's z axis in the world, and its derivative by the marker's rotation
            blocks.by_rate[joint, i] = -gamma * w.i.R[i, 2]
            spin = w.i.R[i, 0] * w.i.w[1] - w.i.R[i, 1] * w.i.w[0]
            blocks.by_angle[joint, i] = -alpha * w.i.R[i, 2] - gamma * spin


@inlined_kernel
def _parent_rows(
    system: System, joint: int, value: float, rate: float, integrator: Integrator, Hv: Array, V: Array, w: Work,
    blocks: Blocks,
) -> None:  # fmt: skip
    """Lp, Hp and Jp: the joint's columns and rows of the parent; needs `_component_rows` first."""
    p = system.side[joint, 0]
    n = 6 + system.elastic[p]
    gamma, alpha = integrator.gamma, integrator.alpha
    marker_velocity_jacobian(marker_of(system, joint, 0), V[p], w.i)
    if system.sliding[joint]:
        slide_velocity_jacobian(n, value, rate, w.R[p], w.i)
    for i in range(3):
        for k in range(3):
            w.E[i, k] = 1.0 if i == k else 0.0
            w.T[i, k] = -w.M[i, k]
    _rows_by_multipliers(n, w.R[p], w.i, w.E, 1.0, blocks.Lp[joint])
    _position_rows(n, w.R[p], w.i, gamma, alpha, -1.0, Hv[p], blocks.Hp[joint])
    # gamma ([Q x]x dphi_i - domega_i) - M dphi_i
    add_skew(w.E, w.y, gamma, w.T)
    for i in range(3):
        w.E[i, i] = -1.0
    _rotation_rows(n, w.i, Hv[p], w.E, w.T, gamma, blocks.Hp[joint])
    for i in range(3):
        for a in range(n):
            blocks.Jp[joint, i, a] = w.i.Jf[i, a]


@inlined_kernel
def _clear_absent_rows(system: System, joint: int, blocks: Blocks) -> None:
    """Zero in the rows and columns that this joint does not have."""
    p = system.side[joint, 0]
    b = system.side[joint, 1]
    for i in range(6):
        if has_row(system, joint, i):
            continue
        blocks.by_angle[joint, i] = 0.0
        blocks.by_rate[joint, i] = 0.0
        for a in range(6 + system.elastic[b]):
            blocks.Lc[joint, a, i] = 0.0
            blocks.Hc[joint, i, a] = 0.0
        if p >= 0:
            for a in range(6 + system.elastic[p]):
                blocks.Lp[joint, a, i] = 0.0
                blocks.Hp[joint, i, a] = 0.0


@inlined_kernel
def _free_slider(system: System, joint: int, w: Work, blocks: Blocks) -> None:
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
    # the remaining gap across the axis, which rotates with the marker
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


@shared_kernel
def joint_tangent(
    system: System, joint: int, value: float, rate: float, integrator: Integrator, Hv: Array, V: Array, w: Work,
    blocks: Blocks,
) -> None:  # fmt: skip
    """All blocks of a joint; needs `joint_kinematics`, `constraint_residual` and the markers' Jacobians first."""
    _component_rows(system, joint, integrator, Hv, V, w, blocks)
    _rows_by_motor(system, joint, integrator, w, blocks)
    if system.side[joint, 0] >= 0:
        _parent_rows(system, joint, value, rate, integrator, Hv, V, w, blocks)
    if slides_freely(system, joint):
        _free_slider(system, joint, w, blocks)
    else:
        _clear_absent_rows(system, joint, blocks)
