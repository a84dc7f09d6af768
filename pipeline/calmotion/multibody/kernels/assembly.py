"""Residual and tangent of the whole system at one instant; compiled. The joint rows are in `joints`."""

from calmotion.arrays import Array
from calmotion.multibody.kernels.components import ComponentMotion, component_of, law_of, marker_of
from calmotion.multibody.kernels.constant_inertia import (
    nonrotating_mass_matrix,
    nonrotating_position_jacobian,
    nonrotating_residual,
    nonrotating_velocity_jacobian,
)
from calmotion.multibody.kernels.inertia import (
    body_residual,
    deformed_integrals,
    mass_matrix,
    position_jacobian,
    velocity_jacobian,
)
from calmotion.multibody.kernels.joint_tangent import joint_tangent
from calmotion.multibody.kernels.joints import add_skew, apply_wrench, constraint_residual, joint_kinematics
from calmotion.multibody.kernels.markers import add_wrench_stiffness, marker_jacobian
from calmotion.multibody.kernels.neohookean import neohookean_forces
from calmotion.multibody.kernels.sliders import LENGTH, rotated_force, slide_jacobian, slide_wrench, slides_freely
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.kernels.stvk import stvk_forces
from calmotion.multibody.kernels.work import Work
from calmotion.multibody.model.system import Blocks, Integrator, State, System
from calmotion.multibody.motors.servos import servo_rows
from calmotion.support.compilation import inlined_kernel, kernel, shared_kernel


@kernel
def _motion_of(system: System, b: int, state: State, Vd: Array, w: Work) -> ComponentMotion:
    """Motion of component b; its acceleration less gravity, R^T (c'' - g), is computed into w.a."""
    for i in range(3):
        t = 0.0
        for k in range(3):
            t += w.R[b, k, i] * (Vd[b, k] - system.gravity[k])
        w.a[i] = t
    return ComponentMotion(w.a, state.V[b, 3:6], Vd[b, 3:6], state.u[b], state.V[b, 6:], Vd[b, 6:])


@shared_kernel
def _rotating_rows(system: System, b: int, state: State, Vd: Array, tangent: bool, w: Work, blocks: Blocks) -> None:
    """Inertia, linear elastic and gravity rows of a rotating component."""
    component, motion = component_of(system, b), _motion_of(system, b, state, Vd, w)
    deformed_integrals(component, motion.u, w)
    body_residual(component, motion, w, blocks.res[b])
    if not tangent:
        return
    mass_matrix(component, w, blocks.D[b])
    velocity_jacobian(component, motion, w, blocks.P[b])
    position_jacobian(component, motion, w, blocks.D[b], blocks.K[b])


@shared_kernel
def _nonrotating_rows(system: System, b: int, state: State, Vd: Array, tangent: bool, w: Work, blocks: Blocks) -> None:
    """The same of a non-rotating component."""
    component, motion = component_of(system, b), _motion_of(system, b, state, Vd, w)
    nonrotating_residual(component, motion, w, blocks.res[b])
    if not tangent:
        return
    nonrotating_mass_matrix(component, w, blocks.D[b])
    nonrotating_velocity_jacobian(component, blocks.P[b])
    nonrotating_position_jacobian(component, motion, blocks.D[b], blocks.K[b])


@inlined_kernel
def _follow_positions(n: int, acceleration: float, Hv: Array, D: Array, P: Array, K: Array) -> None:
    """The chain rule of the integrator: accelerations follow velocities, into P, and these follow positions, into K."""
    beta = Hv[0, 0]
    for i in range(n):
        for k in range(n):
            P[i, k] += acceleration * D[i, k]
        for k in range(3):
            K[i, k] += beta * P[i, k]
            K[i, 3 + k] += P[i, 3] * Hv[1, 1 + k] + P[i, 4] * Hv[2, 1 + k] + P[i, 5] * Hv[3, 1 + k]
        for k in range(6, n):
            K[i, k] += beta * P[i, k]


@shared_kernel
def _joint_forces(system: System, joint: int, angle: float, lam: Array, w: Work, blocks: Blocks) -> None:
    """Adds the forces that a joint transmits to the rows of both components; needs `joint_kinematics` first.

    Leaves force and moment on the component (body and marker axes) in w.wrench[1], the force on the parent (body
    axes) in w.wrench[0, :3] and the moment on it (marker axes), with opposite sign, in w.tau.
    """
    p = system.side[joint, 0]
    b = system.side[joint, 1]
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
    marker_jacobian(marker_of(system, joint, 1), w.j)
    apply_wrench(6 + system.elastic[b], w.wrench[1, :3], w.wrench[1, 3:], -1.0, w.j, blocks.res[b])
    if p >= 0:
        n = 6 + system.elastic[p]
        for i in range(3):
            f = 0.0
            for k in range(3):
                f += w.R[p, k, i] * w.force[k]
            w.wrench[0, i] = f
        marker_jacobian(marker_of(system, joint, 0), w.i)
        if system.sliding[joint]:
            slide_jacobian(n, angle, w.R[p], w.i)
        apply_wrench(n, w.wrench[0, :3], w.tau, 1.0, w.i, blocks.res[p])


@shared_kernel
def _component_stiffness(system: System, joint: int, lam: Array, w: Work, blocks: Blocks) -> None:
    """Adds the derivatives of a joint's force on the component on side 1 by both markers' motion to K and Nc."""
    b = system.side[joint, 1]
    n = 6 + system.elastic[b]
    # the moment on the component follows both markers: dt = [t]x dphi_j - Q^T [tau]x dphi_i
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
    add_wrench_stiffness(marker_of(system, joint, 1), w.wrench[1, :3], t, -1.0, w.j, blocks.K[b])
    if slides_freely(system, joint):
        # the force on both components rotates with the parent-side marker
        w.force[0], w.force[1], w.force[2] = lam[0], lam[1], 0.0
        rotated_force(n, w.force, w.j, w.R[b], w.i.R, -1.0, blocks.Nc[joint])


@shared_kernel
def _parent_stiffness(system: System, joint: int, angle: float, w: Work, blocks: Blocks) -> None:
    """Adds the derivatives of a joint's force on the parent to K, and writes those by a slider's length."""
    p = system.side[joint, 0]
    n = 6 + system.elastic[p]
    free = slides_freely(system, joint)
    if free:
        w.columns[:] = 0.0
        rotated_force(n, w.force, w.i, w.R[p], w.i.R, 1.0, w.columns)
        for a in range(n):
            for k in range(n):
                for i in range(3):
                    blocks.K[p, a, k] += w.columns[a, i] * w.i.Jf[i, k]
    if system.sliding[joint]:
        slide_wrench(n, angle, w.wrench[0, :3], w.tau, 1.0, w.R[p], w.i, blocks.K[p], w.tmp, blocks.on_parent[joint])
        for i in range(3):
            w.tau[i] = w.tmp[i]
    if free:
        for a in range(n):
            blocks.Lp[joint, a, LENGTH] = blocks.on_parent[joint, a]
            blocks.on_parent[joint, a] = 0.0
    add_wrench_stiffness(marker_of(system, joint, 0), w.wrench[0, :3], w.tau, 1.0, w.i, blocks.K[p])


@shared_kernel
def joint_rows(
    system: System, integrator: Integrator, joint: int, angle: float, rate: float, state: State, Hv: Array,
    tangent: bool, w: Work, blocks: Blocks,
) -> None:  # fmt: skip
    """Constraint rows of a joint and the forces it transmits."""
    angle, rate = joint_kinematics(system, joint, angle, rate, state, w)
    constraint_residual(system, joint, angle, rate, integrator, w, blocks.gap[joint])
    _joint_forces(system, joint, angle, state.lam[joint], w, blocks)
    if not tangent:
        return
    joint_tangent(system, joint, angle, rate, integrator, Hv, state.V, w, blocks)
    _component_stiffness(system, joint, state.lam[joint], w, blocks)
    if system.side[joint, 0] >= 0:
        _parent_stiffness(system, joint, angle, w, blocks)
    if system.rotor[joint] >= 0:
        blocks.by_angle[joint] = 0.0  # the command acts on the rotor alone
        blocks.by_rate[joint] = 0.0
        blocks.on_parent[joint] = 0.0


@shared_kernel
def assemble(
    system: System, integrator: Integrator, state: State, Vd: Array, angle: Array, rate: Array, Hv: Array,
    tangent: bool, w: Work, blocks: Blocks,
) -> None:  # fmt: skip
    """Residual, and with `tangent` the linearised blocks, of the whole system at one instant.

    Args:
        state: Its `turn` is not read; entry LENGTH of a free slider's multipliers must be zero.
        Vd: Accelerations, shape [B, N].
        angle, rate: Angle (or length) and rate of each joint's motor, shape [J] (0 for welds).
        Hv: Derivative of velocity by position: Hv[b, 0, 0] the factor for c and u, Hv[b, 1:4, 1:4] the matrix of
            dphi to domega, shape [B, 4, 4].
        tangent: Whether to fill more than `res` and `gap`.
        w, blocks: Scratch and results.
    """
    count = len(system.parent)
    for b in range(count):
        matrix_of(state.q[b], w.R[b])
    for b in system.rotating:
        _rotating_rows(system, b, state, Vd, tangent, w, blocks)
    for b in system.nonrotating:
        _nonrotating_rows(system, b, state, Vd, tangent, w, blocks)
    for b in system.stvk:
        law, u, v = law_of(system, b), state.u[b], state.V[b, 6:]
        stvk_forces(law, u, v, tangent, w.law, blocks.res[b], blocks.P[b], blocks.K[b])
    for b in system.neohookean:
        law, u, v = law_of(system, b), state.u[b], state.V[b, 6:]
        neohookean_forces(law, u, v, tangent, w.law, blocks.res[b], blocks.P[b], blocks.K[b])
    for joint in system.servos:
        servo_rows(system, joint, angle[joint], rate[joint], integrator.gamma, state, Vd, tangent, blocks)
    if tangent:
        acceleration = integrator.acceleration
        for b in range(count):
            _follow_positions(6 + system.elastic[b], acceleration, Hv[b], blocks.D[b], blocks.P[b], blocks.K[b])
    for joint in range(len(system.rows)):
        joint_rows(system, integrator, joint, angle[joint], rate[joint], state, Hv, tangent, w, blocks)
