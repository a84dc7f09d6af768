"""Residual and tangent of the whole system at one instant; compiled. The joint rows are in `joints`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from calmotion.multibody.kernels.constant_inertia import (
    straight_mass_matrix,
    straight_position_jacobian,
    straight_residual,
    straight_velocity_jacobian,
)
from calmotion.multibody.kernels.inertia import (
    body_residual,
    deformed_integrals,
    mass_matrix,
    position_jacobian,
    velocity_jacobian,
)
from calmotion.multibody.kernels.joints import (
    add_skew,
    apply_wrench,
    constraint_residual,
    joint_kinematics,
    joint_tangent,
)
from calmotion.multibody.kernels.markers import (
    WORLD_MARKER,
    MarkerWork,
    add_wrench_stiffness,
    allocate_marker,
    marker_jacobian,
)
from calmotion.multibody.kernels.neohookean import neohookean_forces
from calmotion.multibody.kernels.sliders import LENGTH, slide_jacobian, slide_wrench, slides_freely, turning_force
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.kernels.stvk import stvk_forces
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.shot.character import Array
from calmotion.support.compilation import inlined_kernel, kernel


class Work(NamedTuple):
    """Scratch of `assemble`: rotations of all bodies, integrals of one body, two markers, small matrices, and what
    the forces of nonlinear bodies and free sliders need; and `world`, the moving markers of the world at the instant
    that is assembled (`markers.moving_marker`), shape [W, 18], which the caller sets."""

    R: Array
    s: Array
    Z: Array
    B: Array
    W: Array
    E: Array
    T: Array
    a: Array
    tmp: Array
    x: Array
    y: Array
    Q: Array
    M: Array
    tau: Array
    wrench: Array
    strain: Array
    rows: Array
    seen: Array
    row: Array
    inner: Array
    point: Array
    force: Array
    along: Array
    length: Array
    moved: Array
    columns: Array
    world: Array
    i: MarkerWork
    j: MarkerWork


def allocate_work(system: System) -> Work:
    """Scratch for one system."""
    r = system.size - 6
    seen = system.points[system.stvk]
    p = int(seen.max(initial=0))
    strains = int((system.elastic[system.stvk] + seen * (seen + 1) // 2).max(initial=0))
    points = 18 if len(system.neohookean) else 0
    return Work(
        np.zeros((len(system.parent), 3, 3)), np.zeros(3), np.zeros((3, 3)), np.zeros((r, 3, 3)), np.zeros((3, 3)),
        np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((3, 3)),
        np.zeros((3, 3)), np.zeros(3), np.zeros((2, JOINT_ROWS)), np.zeros(2 * strains),
        np.zeros((max(p, points), max(strains, r if points else 0))), np.zeros((3, p)), np.zeros(p), np.zeros((p, r)),
        np.zeros((points, points)),
        np.zeros(3), np.zeros(1), np.zeros(system.size), np.zeros((2, system.size)), np.zeros((system.size, 3)),
        np.zeros((int(system.moving.max(initial=-1)) + 1, WORLD_MARKER)), allocate_marker(system.size),
        allocate_marker(system.size),
    )  # fmt: skip


@kernel
def _acceleration_less_gravity(system, b, Vd, w):
    """a = R^T (c'' - g) of component b into the scratch."""
    for i in range(3):
        t = 0.0
        for k in range(3):
            t += w.R[b, k, i] * (Vd[b, k] - system.gravity[k])
        w.a[i] = t


@inlined_kernel
def _turning_rows(system, b, u, V, Vd, tangent, w, blocks):
    """Inertia, linear elastic and gravity rows of a component that turns."""
    r = system.elastic[b]
    _acceleration_less_gravity(system, b, Vd, w)
    deformed_integrals(r, system.s[b], system.Z[b], system.M3[b], system.M4[b], system.S[b], u[b], w.s, w.Z, w.B)
    body_residual(
        r, system.mass[b], system.M3[b], system.S[b], system.axial[b], system.stiffness[b], system.damping[b],
        w.a, V[b, 3:6], Vd[b, 3:6], u[b], V[b, 6:], Vd[b, 6:], w.s, w.Z, w.B, w.W, w.tmp, blocks.res[b],
    )  # fmt: skip
    if not tangent:
        return
    mass_matrix(r, system.mass[b], system.M3[b], w.s, w.Z, w.B, blocks.D[b])
    velocity_jacobian(
        r, system.M3[b], system.axial[b], system.damping[b], V[b, 3:6], V[b, 6:], w.s, w.Z, w.B, blocks.P[b]
    )
    position_jacobian(
        r, system.M3[b], system.S[b], system.axial[b], system.stiffness[b], w.a, V[b, 3:6], V[b, 6:], Vd[b, 6:],
        w.B, w.W, blocks.D[b], w.E, w.T, w.tmp, blocks.K[b],
    )  # fmt: skip


@inlined_kernel
def _straight_rows(system, b, u, V, Vd, tangent, w, blocks):
    """The same of a component that never turns."""
    r = system.elastic[b]
    _acceleration_less_gravity(system, b, Vd, w)
    straight_residual(
        r, system.mass[b], system.s[b], system.Z[b], system.M3[b], system.axial0[b], system.stiffness[b],
        system.damping[b], w.a, Vd[b, 3:6], u[b], V[b, 6:], Vd[b, 6:], w.s, blocks.res[b],
    )  # fmt: skip
    if not tangent:
        return
    straight_mass_matrix(r, system.mass[b], w.s, system.Z[b], system.M3[b], system.axial0[b], blocks.D[b])
    straight_velocity_jacobian(r, system.damping[b], blocks.P[b])
    straight_position_jacobian(r, system.M3[b], system.stiffness[b], w.a, Vd[b, 3:6], blocks.D[b], blocks.K[b])


@inlined_kernel
def _add_stvk_forces(system, b, u, v, tangent, w, blocks):
    """Elastic rows of a body of this law; those of a linear one stand with its inertia."""
    stvk_forces(
        system.elastic[b], system.points[b], u, v, system.retardation[b], system.data_start[b], system.data, tangent,
        w.strain, w.rows, w.seen, w.row, w.inner, blocks.res[b], blocks.P[b], blocks.K[b],
    )  # fmt: skip


@inlined_kernel
def _add_neohookean_forces(system, b, u, v, tangent, w, blocks):
    """The same of a Neo-Hookean body."""
    neohookean_forces(
        system.elastic[b], u, v, system.lame[b, 0], system.lame[b, 1], system.retardation[b], system.data_start[b],
        system.points[b], system.data, tangent, w.point, w.rows, blocks.res[b], blocks.P[b], blocks.K[b],
    )  # fmt: skip


@inlined_kernel
def _follow_positions(n, acceleration, Hv, D, P, K):
    """Tangents by what follows: accelerations follow velocities, into P, and these follow positions, into K."""
    beta = Hv[0, 0]
    for i in range(n):
        for k in range(n):
            P[i, k] += acceleration * D[i, k]
        for k in range(3):
            K[i, k] += beta * P[i, k]
            K[i, 3 + k] += P[i, 3] * Hv[1, 1 + k] + P[i, 4] * Hv[2, 1 + k] + P[i, 5] * Hv[3, 1 + k]
        for k in range(6, n):
            K[i, k] += beta * P[i, k]


@inlined_kernel
def _joint_rows(system, scheme, joint, angle, rate, c, u, V, lam, Hv, tangent, w, blocks):
    """Constraint rows of a joint and the forces it transmits."""
    p = system.side[joint, 0]
    b = system.side[joint, 1]
    rb = system.elastic[b]
    angle, rate = joint_kinematics(system, joint, angle, rate, c, u, V, w)
    constraint_residual(system, joint, angle, rate, scheme, w, blocks.gap[joint])
    # force on the component in body axes, moment in marker axes; the parent gets the opposite
    free = slides_freely(system, joint)
    for i in range(3):
        w.tau[i] = lam[3 + i]
        w.force[i] = w.i.R[i, 0] * lam[0] + w.i.R[i, 1] * lam[1] if free else lam[i]
    for i in range(3):
        f = 0.0
        t = 0.0
        for k in range(3):
            f += w.R[b, k, i] * w.force[k]
            t += w.Q[k, i] * w.tau[k]
        w.wrench[1, i] = f
        w.wrench[1, 3 + i] = t
    marker_jacobian(rb, system.rotation[joint, 1], system.Phi[joint, 1], system.Psi[joint, 1], w.j)
    apply_wrench(6 + rb, w.wrench[1, :3], w.wrench[1, 3:], -1.0, w.j, blocks.res[b])
    if p >= 0:
        rp = system.elastic[p]
        for i in range(3):
            f = 0.0
            for k in range(3):
                f += w.R[p, k, i] * w.force[k]
            w.wrench[0, i] = f
        marker_jacobian(rp, system.rotation[joint, 0], system.Phi[joint, 0], system.Psi[joint, 0], w.i)
        if system.sliding[joint]:
            slide_jacobian(6 + rp, angle, w.R[p], w.i)
        apply_wrench(6 + rp, w.wrench[0, :3], w.tau, 1.0, w.i, blocks.res[p])
    if not tangent:
        return
    joint_tangent(system, joint, angle, rate, scheme, Hv, V, w, blocks)
    # the moment on the component follows both markers: dt = [t]x dphi_j - Q^T [tau]x dphi_i
    n = 6 + rb
    t = w.wrench[1, 3:]
    for i in range(3):
        for k in range(3):
            w.T[i, k] = 0.0
            w.E[i, k] = w.Q[k, i]
    add_skew(w.E, w.tau, 1.0, w.T)
    for a in range(n):
        for k in range(3):
            g = 0.0
            for i in range(3):
                g += w.j.Jf[i, a] * w.T[i, k]
            blocks.Nc[joint, a, k] = g
        # -Jf^T [t]x Jf: rows (t x Jf_a)^T
        g0 = t[1] * w.j.Jf[2, a] - t[2] * w.j.Jf[1, a]
        g1 = t[2] * w.j.Jf[0, a] - t[0] * w.j.Jf[2, a]
        g2 = t[0] * w.j.Jf[1, a] - t[1] * w.j.Jf[0, a]
        for k in range(n):
            blocks.K[b, a, k] += g0 * w.j.Jf[0, k] + g1 * w.j.Jf[1, k] + g2 * w.j.Jf[2, k]
    add_wrench_stiffness(
        rb, system.law[b], system.rotation[joint, 1], system.Phi[joint, 1], system.Psi[joint, 1], w.wrench[1, :3], t,
        -1.0, w.j, blocks.K[b],
    )  # fmt: skip
    if free:
        # the force on both turns with the parent-side marker
        w.force[0], w.force[1], w.force[2] = lam[0], lam[1], 0.0
        turning_force(n, w.force, w.j, w.R[b], w.i.R, -1.0, blocks.Nc[joint])
    if p >= 0:
        rp = system.elastic[p]
        if free:
            w.columns[:] = 0.0
            turning_force(6 + rp, w.force, w.i, w.R[p], w.i.R, 1.0, w.columns)
            for a in range(6 + rp):
                for k in range(6 + rp):
                    for i in range(3):
                        blocks.K[p, a, k] += w.columns[a, i] * w.i.Jf[i, k]
        if system.sliding[joint]:
            slide_wrench(
                6 + rp, angle, w.wrench[0, :3], w.tau, 1.0, w.R[p], w.i, blocks.K[p], w.tmp, blocks.on_parent[joint]
            )
            for i in range(3):
                w.tau[i] = w.tmp[i]
        if free:
            for a in range(6 + rp):
                blocks.Lp[joint, a, LENGTH] = blocks.on_parent[joint, a]
                blocks.on_parent[joint, a] = 0.0
        add_wrench_stiffness(
            rp, system.law[p], system.rotation[joint, 0], system.Phi[joint, 0], system.Psi[joint, 0],
            w.wrench[0, :3], w.tau, 1.0, w.i, blocks.K[p],
        )  # fmt: skip


@kernel
def assemble(system, scheme, c, q, u, V, Vd, lam, angle, rate, Hv, tangent, w, blocks):
    """Residual, and with `tangent` the linearised blocks, of the whole system at one instant.

    Args:
        c, q, u: Positions, see `State`.
        V, Vd: Velocities and accelerations, shape [B, N].
        lam: Multipliers, shape [J, 6]; entry LENGTH of a free slider must be zero.
        angle, rate: Angle (or length) and rate of each joint's motor, shape [J] (0 for welds).
        Hv: How velocity follows position: Hv[b, 0, 0] the factor for c and u, Hv[b, 1:4, 1:4] the matrix of
            dphi to domega, shape [B, 4, 4].
        tangent: Whether to fill more than `res` and `gap`.
        w, blocks: Scratch and results.
    """
    count = len(system.parent)
    for b in range(count):
        matrix_of(q[b], w.R[b])
    for b in system.turning:
        _turning_rows(system, b, u, V, Vd, tangent, w, blocks)
    for b in system.straight:
        _straight_rows(system, b, u, V, Vd, tangent, w, blocks)
    for b in system.stvk:
        _add_stvk_forces(system, b, u[b], V[b, 6:], tangent, w, blocks)
    for b in system.neohookean:
        _add_neohookean_forces(system, b, u[b], V[b, 6:], tangent, w, blocks)
    if tangent:
        for b in range(count):
            _follow_positions(6 + system.elastic[b], scheme.acceleration, Hv[b], blocks.D[b], blocks.P[b], blocks.K[b])
    for joint in range(len(system.rows)):
        _joint_rows(system, scheme, joint, angle[joint], rate[joint], c, u, V, lam[joint], Hv, tangent, w, blocks)
