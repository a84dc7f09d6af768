"""The parent-side marker of a slider, moved along its own z axis by the motor's length; compiled.

With A = R^T R_m the marker's axes in the body's, d the length and z the marker's third axis, the marker's point moves
by R_m z d. A force f (world) at the moved point is the force f at the marker and the moment d z x R_m^T f about it, so
that what `markers` knows of a marker serves a slider too.
"""

from __future__ import annotations

from ..kernels import kernel


@kernel
def slide(value, rate, m):
    """Move the marker: its position and velocity, after `marker_values` or `fixed_marker`."""
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
