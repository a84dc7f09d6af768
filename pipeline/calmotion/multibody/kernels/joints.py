"""Rows of one joint: constraints and the forces they transmit; compiled. Their derivatives are in `joint_tangent`.

The rows (side i on the parent, j on the component; Q = R_i^T R_j, z the joint axis, theta the motor's angle):

    gamma (p_j' - p_i') + alpha (p_j - p_i)                            3 rows, world axes
    gamma (Q (omega_j - theta' z) - omega_i) + alpha c                 3 rows (weld, motor), parent-side axes
    the x and y rows of it, without theta'                             2 rows (free hinge)
    no further row                                                     a ball joint
    no row                                                             a component that floats freely, a contact
                                                                       that does not hold

On a slider theta is a length: the parent-side marker is moved along its z axis by it, and the rotation is locked; a
free one has no row along its axis (`sliders`). Here
c is the axial vector of the skew part of E = Q R_z(-theta), and (-n_y, n_x), n = Q z, for the hinge. On the
constraint manifold these rows are C_t + C_U T V + alpha C of Seed (31); the multipliers act through exactly the
transpose of their velocity Jacobian, so they do no work there.
"""

import math

from calmotion.arrays import Array
from calmotion.multibody.kernels.components import marker_of
from calmotion.multibody.kernels.markers import MarkerWork, fixed_marker, marker_values, moving_marker
from calmotion.multibody.kernels.sliders import LENGTH, free_length, slide, slides_freely
from calmotion.multibody.kernels.work import Work
from calmotion.multibody.model.system import Integrator, State, System
from calmotion.support.compilation import kernel, shared_kernel


@kernel
def apply_wrench(n: int, f: Array, t: Array, sign: float, m: MarkerWork, res: Array) -> None:
    """res += sign * (Jp^T f + Jf^T t), f in body axes, t in marker axes."""
    for a in range(n):
        g = 0.0
        for i in range(3):
            g += m.Jp[i, a] * f[i] + m.Jf[i, a] * t[i]
        res[a] += sign * g


@kernel
def is_hinge(system: System, joint: int) -> bool:
    """Whether a joint rotates freely about one axis."""
    return system.rows[joint] == 5 and not system.sliding[joint]


@kernel
def firmness(system: System, joint: int, integrator: Integrator) -> float:
    """Baumgarte's coefficient of a joint's rows: none of a contact in motion, which holds its frame where that is."""
    if system.contact[joint] != 0 and integrator.gamma != 0.0:
        return 0.0
    alpha: float = integrator.alpha
    return alpha


@shared_kernel
def joint_kinematics(
    system: System, joint: int, value: float, rate: float, state: State, w: Work
) -> tuple[float, float]:
    """Values of both markers of a joint at its motor's value and rate, and Q = R_i^T R_j into w.Q.

    Returns:
        The joint's value and rate: its motor's, or the length of a free slider, whose rate its rows do not need. The
        marker behind a rotor turns with it, and has none.
    """
    p = system.side[joint, 0]
    b = system.side[joint, 1]
    c, u, V = state.c, state.u, state.V
    if p < 0 and system.moving[joint] >= 0:
        moving_marker(w.world[system.moving[joint]], w.i)
    elif p < 0:
        fixed_marker(system.position[joint, 0], system.rotation[joint, 0], w.i)
    else:
        marker_values(marker_of(system, joint, 0), c[p], w.R[p], u[p], V[p], w.i)
    marker_values(marker_of(system, joint, 1), c[b], w.R[b], u[b], V[b], w.j)
    if system.rotor[joint] >= 0:
        value, rate = 0.0, 0.0
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
def _rotated_back(Q: Array, angle: float, E: Array) -> None:
    """E = Q R_z(-angle)."""
    cs, sn = math.cos(angle), math.sin(angle)
    for i in range(3):
        E[i, 0] = Q[i, 0] * cs - Q[i, 1] * sn
        E[i, 1] = Q[i, 0] * sn + Q[i, 1] * cs
        E[i, 2] = Q[i, 2]


@shared_kernel
def constraint_residual(
    system: System, joint: int, angle: float, rate: float, integrator: Integrator, w: Work, gap: Array
) -> None:
    """Residual of a joint's rows; leaves omega_j - theta' z in w.x, E in w.E, and the unused part of a free slider's
    first three rows, that along its axis, in w.along[0]."""
    hinge = is_hinge(system, joint)
    alpha = firmness(system, joint, integrator)
    if system.sliding[joint]:
        angle = 0.0
        rate = 0.0
    for i in range(3):
        gap[i] = integrator.gamma * (w.j.pd[i] - w.i.pd[i]) + alpha * (w.j.p[i] - w.i.p[i])
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
        gap[3] = integrator.gamma * (w.y[0] - w.i.w[0]) - alpha * w.Q[1, 2]
        gap[4] = integrator.gamma * (w.y[1] - w.i.w[1]) + alpha * w.Q[0, 2]
        gap[5] = 0.0
        return
    _rotated_back(w.Q, angle, w.E)
    E = w.E
    gap[3] = integrator.gamma * (w.y[0] - w.i.w[0]) + 0.5 * alpha * (E[2, 1] - E[1, 2])
    gap[4] = integrator.gamma * (w.y[1] - w.i.w[1]) + 0.5 * alpha * (E[0, 2] - E[2, 0])
    gap[5] = integrator.gamma * (w.y[2] - w.i.w[2]) + 0.5 * alpha * (E[1, 0] - E[0, 1])
    if system.rows[joint] <= 3:
        for i in range(system.rows[joint], 6):
            gap[i] = 0.0


@kernel
def add_skew(A: Array, x: Array, sign: float, out: Array) -> None:
    """out += sign A [x]x."""
    for i in range(3):
        out[i, 0] += sign * (A[i, 1] * x[2] - A[i, 2] * x[1])
        out[i, 1] += sign * (A[i, 2] * x[0] - A[i, 0] * x[2])
        out[i, 2] += sign * (A[i, 0] * x[1] - A[i, 1] * x[0])
