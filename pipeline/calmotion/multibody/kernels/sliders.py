"""Joints with a length: the parent-side marker is moved along its own z axis by it; compiled.

With A = R^T R_m the marker's axes in the body's, d the length and z the marker's third axis, the marker's point moves
by R_m z d. A force f (world) at the moved point is the force f at the marker and the moment d z x R_m^T f about it, so
that what `markers` knows of a marker serves a slider too.

Where a motor sets d, the joint has the six rows of a weld. On a free slider d = z . R_m^T (p_j - p_m) follows the
motion: rows and force are taken in the marker's axes, those along z fall away, and their place (number LENGTH) is
taken by the length as an unknown of its own: its row is its definition, and its column how the force on the parent
moves with it, which nothing else in the tree's equations could hold.
"""

from __future__ import annotations

from calmotion.multibody.model.system import JOINT_ROWS
from calmotion.support.compilation import kernel

LENGTH = 2


@kernel
def slides_freely(system, joint):
    """Whether a joint is a slider without a motor."""
    return system.sliding[joint] != 0 and system.rows[joint] < JOINT_ROWS


@kernel
def has_row(system, joint, i):
    """Whether row i of a joint is one of its constraints."""
    if slides_freely(system, joint):
        return i != LENGTH
    return i < system.rows[joint]


@kernel
def free_length(mi, mj):
    """Length of a free slider, before `slide`."""
    t = 0.0
    for i in range(3):
        t += mi.R[i, 2] * (mj.p[i] - mi.p[i])
    return t


@kernel
def slide(value, rate, m):
    """Move the marker: its position and velocity, after `marker_values`, `fixed_marker` or `moving_marker`."""
    for i in range(3):
        m.p[i] += m.R[i, 2] * value
        # omega x z = (omega_y, -omega_x, 0) in marker axes
        m.pd[i] += value * (m.R[i, 0] * m.w[1] - m.R[i, 1] * m.w[0]) + m.R[i, 2] * rate


@kernel
def _marker_axes(Rb, m):
    """A = R^T R_m into m.C."""
    for i in range(3):
        for k in range(3):
            t = 0.0
            for n in range(3):
                t += Rb[n, i] * m.R[n, k]
            m.C[i, k] = t


@kernel
def slide_jacobian(n, value, Rb, m):
    """Jp of the moved point, after `marker_jacobian`."""
    _marker_axes(Rb, m)
    for a in range(n):
        for i in range(3):
            m.Jp[i, a] += value * (m.C[i, 0] * m.Jf[1, a] - m.C[i, 1] * m.Jf[0, a])


@kernel
def slide_velocity_jacobian(n, value, rate, Rb, m):
    """Gp of the moved point, after `marker_velocity_jacobian`."""
    _marker_axes(Rb, m)
    # the velocity that sliding adds, in marker axes
    q0, q1, q2 = value * m.w[1], -value * m.w[0], rate
    for a in range(n):
        f0, f1, f2 = m.Jf[0, a], m.Jf[1, a], m.Jf[2, a]
        x0 = f1 * q2 - f2 * q1 + value * m.Gf[1, a]
        x1 = f2 * q0 - f0 * q2 - value * m.Gf[0, a]
        x2 = f0 * q1 - f1 * q0
        for i in range(3):
            m.Gp[i, a] += m.C[i, 0] * x0 + m.C[i, 1] * x1 + m.C[i, 2] * x2


@kernel
def slide_wrench(n, value, f, t, sign, Rb, m, K, moment, on_parent):
    """The moment that stands for a force at the moved point, and what follows from it.

    Args:
        f: R^T f, body axes, shape [3].
        t: Moment in marker axes, shape [3].
        moment: t + d z x R_m^T f, for `add_wrench_stiffness`; result, shape [3].
        K: += sign * derivative of the generalised force by the marker's turning under a fixed f, shape [n, n].
        on_parent: sign * derivative of the generalised force by the length; result, shape [n].
    """
    _marker_axes(Rb, m)
    f0 = m.C[0, 0] * f[0] + m.C[1, 0] * f[1] + m.C[2, 0] * f[2]
    f1 = m.C[0, 1] * f[0] + m.C[1, 1] * f[1] + m.C[2, 1] * f[2]
    f2 = m.C[0, 2] * f[0] + m.C[1, 2] * f[1] + m.C[2, 2] * f[2]
    # z x f = (-f_y, f_x, 0)
    moment[0] = t[0] - value * f1
    moment[1] = t[1] + value * f0
    moment[2] = t[2]
    for a in range(n):
        on_parent[a] = sign * (m.Jf[1, a] * f0 - m.Jf[0, a] * f1)
        for k in range(n):
            # a turning dphi changes R_m^T f by f x dphi
            g0 = f1 * m.Jf[2, k] - f2 * m.Jf[1, k]
            g1 = f2 * m.Jf[0, k] - f0 * m.Jf[2, k]
            K[a, k] += sign * value * (m.Jf[1, a] * g0 - m.Jf[0, a] * g1)


@kernel
def turning_force(n, f, m, Rb, Rm, sign, out):
    """out += sign * derivative of the generalised force of R_m f by the turning of R_m.

    Args:
        f: Force in the axes that turn, shape [3].
        m: Marker at whose point it acts, on the body of rotation Rb.
        Rm: Rotation that turns.
        out: Shape [n, 3].
    """
    for k in range(3):
        p, q = (k + 1) % 3, (k + 2) % 3
        for i in range(3):
            # d(R_m f) = R_m (dphi x f)
            g = 0.0
            for l in range(3):
                g += Rb[l, i] * (f[p] * Rm[l, q] - f[q] * Rm[l, p])
            for a in range(n):
                out[a, k] += sign * m.Jp[i, a] * g


@kernel
def free_rows(n, Rm, length, moved, by_length, H):
    """Constraint rows of a free slider from those of a driven one: H, shape [6, n], by the coordinates of one side.

    Args:
        Rm: Rotation of the parent-side marker.
        length: Derivative of the length by the same coordinates, shape [n].
        moved: What the marker's turning adds to the first three rows, shape [3, n].
        by_length: The first three rows by the length, world axes.
    """
    for a in range(n):
        x = H[0, a] + by_length[0] * length[a]
        y = H[1, a] + by_length[1] * length[a]
        z = H[2, a] + by_length[2] * length[a]
        for i in range(2):
            H[i, a] = Rm[0, i] * x + Rm[1, i] * y + Rm[2, i] * z + moved[i, a]
        H[LENGTH, a] = -length[a]


@kernel
def free_columns(n, Rm, L):
    """Columns of a free slider's force from those of a driven one, world axes: L, shape [n, 6]."""
    for a in range(n):
        x, y, z = L[a, 0], L[a, 1], L[a, 2]
        for i in range(2):
            L[a, i] = Rm[0, i] * x + Rm[1, i] * y + Rm[2, i] * z
        L[a, LENGTH] = 0.0
