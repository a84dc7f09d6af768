"""Prismatic joints: the parent-side marker is moved along its own z axis by the joint's length; compiled.

With A = R^T R_m the marker's axes in the body's, d the length and z the marker's third axis, the marker's point moves
by R_m z d. A force f (world) at the moved point is the force f at the marker and the moment d z x R_m^T f about it, so
that the functions of `markers` apply to sliders.

Where a motor sets d, the joint has the six rows of a weld. On a free slider d = z . R_m^T (p_j - p_m) follows the
motion: rows and force are taken in the marker's axes, those along z are removed, and their place (number LENGTH) is
taken by the length as an unknown: its row is its definition, and its column the derivative of the force on the parent
by the length, which no other term of the tree's equations contains.
"""

from calmotion.arrays import Array
from calmotion.multibody.kernels.markers import MarkerWork
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.support.compilation import kernel, shared_kernel

LENGTH = 2


@kernel
def slides_freely(system: System, joint: int) -> bool:
    """Whether a joint is a slider without a motor."""
    free: bool = system.sliding[joint] != 0 and system.rows[joint] < JOINT_ROWS
    return free


@kernel
def has_row(system: System, joint: int, i: int) -> bool:
    """Whether row i of a joint is one of its constraints."""
    if slides_freely(system, joint):
        return i != LENGTH
    present: bool = i < system.rows[joint]
    return present


@kernel
def free_length(mi: MarkerWork, mj: MarkerWork) -> float:
    """Length of a free slider, before `slide`."""
    t = 0.0
    for i in range(3):
        t += mi.R[i, 2] * (mj.p[i] - mi.p[i])
    return t


@kernel
def slide(value: float, rate: float, m: MarkerWork) -> None:
    """Move the marker: its position and velocity, after `marker_values`, `fixed_marker` or `moving_marker`."""
    for i in range(3):
        m.p[i] += m.R[i, 2] * value
        # omega x z = (omega_y, -omega_x, 0) in marker axes
        m.pd[i] += value * (m.R[i, 0] * m.w[1] - m.R[i, 1] * m.w[0]) + m.R[i, 2] * rate


@kernel
def _marker_axes(Rb: Array, m: MarkerWork) -> None:
    """A = R^T R_m into m.C."""
    for i in range(3):
        for k in range(3):
            t = 0.0
            for n in range(3):
                t += Rb[n, i] * m.R[n, k]
            m.C[i, k] = t


@shared_kernel
def slide_jacobian(n: int, value: float, Rb: Array, m: MarkerWork) -> None:
    """Jp of the moved point, after `marker_jacobian`."""
    _marker_axes(Rb, m)
    for a in range(n):
        for i in range(3):
            m.Jp[i, a] += value * (m.C[i, 0] * m.Jf[1, a] - m.C[i, 1] * m.Jf[0, a])


@shared_kernel
def slide_velocity_jacobian(n: int, value: float, rate: float, Rb: Array, m: MarkerWork) -> None:
    """Gp of the moved point, after `marker_velocity_jacobian`."""
    _marker_axes(Rb, m)
    # the velocity added by sliding, in marker axes
    q0, q1, q2 = value * m.w[1], -value * m.w[0], rate
    for a in range(n):
        f0, f1, f2 = m.Jf[0, a], m.Jf[1, a], m.Jf[2, a]
        x0 = f1 * q2 - f2 * q1 + value * m.Gf[1, a]
        x1 = f2 * q0 - f0 * q2 - value * m.Gf[0, a]
        x2 = f0 * q1 - f1 * q0
        for i in range(3):
            m.Gp[i, a] += m.C[i, 0] * x0 + m.C[i, 1] * x1 + m.C[i, 2] * x2


@shared_kernel
def slide_wrench(
    n: int, value: float, f: Array, t: Array, sign: float, Rb: Array, m: MarkerWork, K: Array, moment: Array,
    on_parent: Array,
) -> None:  # fmt: skip
    """The moment about the marker of a force at the moved point, and its derivatives.

    Args:
        f: R^T f, body axes, shape [3].
        t: Moment in marker axes, shape [3].
        moment: t + d z x R_m^T f, for `add_wrench_stiffness`; result, shape [3].
        K: += sign * derivative of the generalised force by the marker's rotation under a fixed f, shape [n, n].
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
            # a rotation dphi changes R_m^T f by f x dphi
            g0 = f1 * m.Jf[2, k] - f2 * m.Jf[1, k]
            g1 = f2 * m.Jf[0, k] - f0 * m.Jf[2, k]
            K[a, k] += sign * value * (m.Jf[1, a] * g0 - m.Jf[0, a] * g1)


@shared_kernel
def rotated_force(n: int, f: Array, m: MarkerWork, Rb: Array, Rm: Array, sign: float, out: Array) -> None:
    """out += sign * derivative of the generalised force of R_m f by the rotation of R_m.

    Args:
        f: Force in the axes that rotate, shape [3].
        m: Marker at whose point it acts, on the body of rotation Rb.
        Rm: Rotation matrix of these axes.
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
def free_rows(n: int, Rm: Array, length: Array, moved: Array, by_length: Array, H: Array) -> None:
    """Constraint rows of a free slider from those of a driven one: H, shape [6, n], by the coordinates of one side.

    Args:
        Rm: Rotation of the parent-side marker.
        length: Derivative of the length by the same coordinates, shape [n].
        moved: Derivative of the first two rows by the marker's rotation, shape [2, n].
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
def free_columns(n: int, Rm: Array, L: Array) -> None:
    """Columns of a free slider's force from those of a driven one, world axes: L, shape [n, 6]."""
    for a in range(n):
        x, y, z = L[a, 0], L[a, 1], L[a, 2]
        for i in range(2):
            L[a, i] = Rm[0, i] * x + Rm[1, i] * y + Rm[2, i] * z
        L[a, LENGTH] = 0.0
