"""Kinematics of a marker on a (flexible) component, its Jacobians and the forces that act through it; compiled.

A marker sits at y = X + Phi u in the body frame and is rotated by exp(psi), psi = Psi u, before its rest rotation:

    p = c + R y            p' = w + R (omega x y + Phi v)
    R_m = R exp(psi) R_0   omega_m = R_0^T ( exp(-psi) omega + J_r(psi) Psi v )

(On bodies of large deflection another map stands for exp, and its Jacobian for J_r: `finite_rotation`.)

World axes for p and p', marker axes for omega_m. A force f (world) and a moment t (marker axes) at the marker
do the virtual work f . dp + t . dphi_m, hence the generalised force (R^T f, y x R^T f + exp(psi) R_0 t,
Phi^T R^T f + Psi^T J_r^T R_0 t) on (R^T dc, dphi, du).
"""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.kernels.components import ComponentMarker
from calmotion.multibody.kernels.finite_rotation import interface_rotation, interface_rotation_derivative
from calmotion.multibody.kernels.so3 import cross
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import kernel, shared_kernel


@by_reference
class MarkerWork(NamedTuple):
    """Scratch and results of one marker; see the module for the symbols.

    `Jp` (body axes) and `Jf` map (R^T dc, dphi, du) to R^T dp and dphi_m, and velocities to R^T p' and omega_m;
    `Gp`, `Gf` are the derivatives of R^T-turned p' and of omega_m by position at fixed velocity, shapes [3, N].
    """

    p: Array
    y: Array
    yd: Array
    pd: Array
    R: Array
    w: Array
    ex: Array
    jr: Array
    e: Array
    psi: Array
    psid: Array
    Jp: Array
    Jf: Array
    Gp: Array
    Gf: Array
    A: Array
    C: Array


def allocate_marker(size: int) -> MarkerWork:
    """Scratch for components of `size` = 6 + R coordinates."""
    vector, square, wide = 3, (3, 3), (3, size)
    shapes = [vector] * 4 + [square, vector, square, square, vector, vector, vector] + [wide] * 4 + [square] * 2
    return MarkerWork(*[np.zeros(shape) for shape in shapes])


@kernel
def fixed_marker(position: Array, rotation: Array, m: MarkerWork) -> None:
    """A marker of the world: constant frame, no velocity."""
    for i in range(3):
        m.p[i] = position[i]
        m.pd[i] = 0.0
        m.w[i] = 0.0
        for k in range(3):
            m.R[i, k] = rotation[i, k]


WORLD_MARKER = 18  # entries of a moving marker of the world


@kernel
def moving_marker(frame: Array, m: MarkerWork) -> None:
    """A marker of the world whose motion is given: position, velocity, angular velocity in marker axes, and its
    rotation matrix by rows, shape [18]."""
    for i in range(3):
        m.p[i] = frame[i]
        m.pd[i] = frame[3 + i]
        m.w[i] = frame[6 + i]
        for k in range(3):
            m.R[i, k] = frame[9 + 3 * i + k]


@shared_kernel
def marker_values(marker: ComponentMarker, c: Array, Rb: Array, u: Array, V: Array, m: MarkerWork) -> None:
    """Position, velocity, rotation and angular velocity of the marker, into m.

    Args:
        c, Rb, u, V: Origin, rotation matrix, elastic coordinates and velocities of its component.
    """
    r, position, rotation, Phi, Psi = marker.r, marker.position, marker.rotation, marker.Phi, marker.Psi
    om = V[3:6]
    for i in range(3):
        y = position[i]
        yd = 0.0
        psi = 0.0
        psid = 0.0
        for j in range(r):
            y += Phi[i, j] * u[j]
            yd += Phi[i, j] * V[6 + j]
            psi += Psi[i, j] * u[j]
            psid += Psi[i, j] * V[6 + j]
        m.y[i] = y
        m.psi[i] = psi
        m.psid[i] = psid
        m.p[i] = yd
    cross(om, m.y, m.yd)
    for i in range(3):
        m.yd[i] += m.p[i]
    interface_rotation(marker.law, m.psi, m.ex, m.jr)
    for i in range(3):
        p = c[i]
        pd = V[i]
        e = 0.0
        for k in range(3):
            p += Rb[i, k] * m.y[k]
            pd += Rb[i, k] * m.yd[k]
            e += m.ex[k, i] * om[k]
            t = 0.0
            for n in range(3):
                t += Rb[i, n] * m.ex[n, k]
            m.A[i, k] = t
        m.p[i] = p
        m.pd[i] = pd
        m.e[i] = e
    for i in range(3):
        t = m.e[i]
        for k in range(3):
            t += m.jr[i, k] * m.psid[k]
            q = 0.0
            for n in range(3):
                q += m.A[i, n] * rotation[n, k]
            m.R[i, k] = q
        m.C[0, i] = t
    for i in range(3):
        m.w[i] = rotation[0, i] * m.C[0, 0] + rotation[1, i] * m.C[0, 1] + rotation[2, i] * m.C[0, 2]


@kernel
def _minus_skew(y: Array, out: Array, column: int) -> None:
    """out[:, column:column+3] = -[y]x."""
    out[0, column] = 0.0
    out[0, column + 1] = y[2]
    out[0, column + 2] = -y[1]
    out[1, column] = -y[2]
    out[1, column + 1] = 0.0
    out[1, column + 2] = y[0]
    out[2, column] = y[1]
    out[2, column + 1] = -y[0]
    out[2, column + 2] = 0.0


@kernel
def _rotate_rows(rotation: Array, B: Array, Psi: Array, r: int, out: Array) -> None:
    """out[:, 6:] = R_0^T B Psi."""
    for i in range(3):
        b0 = rotation[0, i] * B[0, 0] + rotation[1, i] * B[1, 0] + rotation[2, i] * B[2, 0]
        b1 = rotation[0, i] * B[0, 1] + rotation[1, i] * B[1, 1] + rotation[2, i] * B[2, 1]
        b2 = rotation[0, i] * B[0, 2] + rotation[1, i] * B[1, 2] + rotation[2, i] * B[2, 2]
        for j in range(r):
            out[i, 6 + j] = b0 * Psi[0, j] + b1 * Psi[1, j] + b2 * Psi[2, j]


@shared_kernel
def marker_jacobian(marker: ComponentMarker, m: MarkerWork) -> None:
    """Jp and Jf of the marker; needs `marker_values` first."""
    r, rotation, Phi, Psi = marker.r, marker.rotation, marker.Phi, marker.Psi
    for i in range(3):
        for k in range(3):
            m.Jp[i, k] = 0.0
            m.Jf[i, k] = 0.0
            t = 0.0
            for n in range(3):
                t += rotation[n, i] * m.ex[k, n]
            m.Jf[i, 3 + k] = t
        m.Jp[i, i] = 1.0
        for j in range(r):
            m.Jp[i, 6 + j] = Phi[i, j]
    _minus_skew(m.y, m.Jp, 3)
    _rotate_rows(rotation, m.jr, Psi, r, m.Jf)


@shared_kernel
def marker_velocity_jacobian(marker: ComponentMarker, V: Array, m: MarkerWork) -> None:
    """Gp and Gf of the marker; needs `marker_values` first."""
    r, rotation, Phi, Psi = marker.r, marker.rotation, marker.Phi, marker.Psi
    om = V[3:6]
    for i in range(3):
        k, n = (i + 1) % 3, (i + 2) % 3
        for l in range(6):
            m.Gp[i, l] = 0.0
            m.Gf[i, l] = 0.0
        for j in range(r):
            m.Gp[i, 6 + j] = om[k] * Phi[n, j] - om[n] * Phi[k, j]
    _minus_skew(m.yd, m.Gp, 3)
    # d(exp(-psi) omega) = [e]x J_r dpsi, and d(J_r(psi) psid)
    interface_rotation_derivative(marker.law, m.psi, m.psid, 1.0, m.A)
    for i in range(3):
        k, n = (i + 1) % 3, (i + 2) % 3
        for l in range(3):
            m.A[i, l] += m.e[k] * m.jr[n, l] - m.e[n] * m.jr[k, l]
    _rotate_rows(rotation, m.A, Psi, r, m.Gf)


@shared_kernel
def add_wrench_stiffness(marker: ComponentMarker, f: Array, t: Array, sign: float, m: MarkerWork, K: Array) -> None:
    """K += sign * d(generalised force)/d(R^T dc, dphi, du) for a force f fixed in the world and a moment t fixed
    in marker axes; needs `marker_values` first.

    Args:
        f: R^T f, body axes, shape [3].
        t: Moment in marker axes, shape [3].
    """
    r, rotation, Phi, Psi = marker.r, marker.rotation, marker.Phi, marker.Psi
    # [f]x in A
    _minus_skew(f, m.A, 0)
    for i in range(3):
        for k in range(3):
            m.A[i, k] = -m.A[i, k]
            K[i, 3 + k] += sign * m.A[i, k]
    for i in range(3):
        k, n = (i + 1) % 3, (i + 2) % 3
        for l in range(3):
            K[3 + i, 3 + l] += sign * (m.y[k] * m.A[n, l] - m.y[n] * m.A[k, l])
    if r == 0:
        return
    for j in range(r):
        for l in range(3):
            g = 0.0
            h = 0.0
            for i in range(3):
                g += Phi[i, j] * m.A[i, l]
                h += m.A[l, i] * Phi[i, j]
            K[6 + j, 3 + l] += sign * g
            K[3 + l, 6 + j] -= sign * h
    b = m.e  # scratch: R_0 t
    for i in range(3):
        b[i] = rotation[i, 0] * t[0] + rotation[i, 1] * t[1] + rotation[i, 2] * t[2]
    # d(exp(psi) b) = -exp(psi) [b]x J_r dpsi
    for i in range(3):
        k, n = (i + 1) % 3, (i + 2) % 3
        for l in range(3):
            m.A[i, l] = b[k] * m.jr[n, l] - b[n] * m.jr[k, l]
    for i in range(3):
        for l in range(3):
            m.C[i, l] = -(m.ex[i, 0] * m.A[0, l] + m.ex[i, 1] * m.A[1, l] + m.ex[i, 2] * m.A[2, l])
    for i in range(3):
        for j in range(r):
            K[3 + i, 6 + j] += sign * (m.C[i, 0] * Psi[0, j] + m.C[i, 1] * Psi[1, j] + m.C[i, 2] * Psi[2, j])
    # J_r(psi)^T = J_r(-psi)
    interface_rotation_derivative(marker.law, m.psi, b, -1.0, m.A)
    for j in range(r):
        for i in range(3):
            m.C[0, i] = Psi[0, j] * m.A[0, i] + Psi[1, j] * m.A[1, i] + Psi[2, j] * m.A[2, i]
        for l in range(r):
            K[6 + j, 6 + l] += sign * (m.C[0, 0] * Psi[0, l] + m.C[0, 1] * Psi[1, l] + m.C[0, 2] * Psi[2, l])
