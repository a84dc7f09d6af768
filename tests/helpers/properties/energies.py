"""Energy of a simulation and work of its motors.

Both follow from inertia integrals, elastic laws and multipliers, none from the equations of a step.
"""

import numpy as np
from calmotion.arrays import Array, IntArray
from calmotion.model import Character
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.kernels import inertia
from calmotion.multibody.kernels.components import component_of
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.kernels.work import Work, allocate_work
from calmotion.multibody.model.system import LINEAR, STVK, State, System
from calmotion.simulation.forward import ForwardRun


def energy(system: System, states: State, instants: IntArray | None = None) -> tuple[Array, Array]:
    """Kinetic energy and all of it [J], shape [T] each; laws linear or St. Venant-Kirchhoff.

    Args:
        instants: Indices of the states; None: all.
    """
    chosen = np.arange(len(states.c)) if instants is None else instants
    kinetic, stored = np.zeros(len(chosen)), np.zeros(len(chosen))
    scratch = allocate_work(system)
    for b in range(len(system.elastic)):
        for k, n in enumerate(chosen):
            R, D, V = _moving(system, states, b, int(n), scratch)
            kinetic[k] += 0.5 * V @ D @ V
            u = states.u[n, b, : system.elastic[b]]
            stored[k] += _strain_energy(system, b, u) - system.gravity @ (
                system.mass[b] * states.c[n, b] + R @ scratch.s
            )
    return kinetic, kinetic + stored


def work(system: System, run: ForwardRun) -> Array:
    """Work of the motors since the first instant [J], shape [T]."""
    efforts = reactions(system, run.trajectory, run.joint_angles, run.joint_rates).efforts
    return _integral(np.sum(efforts * run.joint_rates, axis=1), run.trajectory.h)


def _integral(values: Array, h: float) -> Array:
    """Integral by the trapezoidal rule from the first instant."""
    steps = 0.5 * h * (values[1:] + values[:-1])
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(steps, axis=0)])


def _moving(system: System, states: State, b: int, n: int, scratch: Work) -> tuple[Array, Array, Array]:
    """Rotation matrix, mass matrix and velocities in body axes of a body at an instant."""
    r = system.elastic[b]
    R, D, V = np.zeros((3, 3)), np.zeros((6 + r, 6 + r)), states.V[n, b, : 6 + r].copy()
    component = component_of.py_func(system, b)  # type: ignore[attr-defined]
    inertia.deformed_integrals(component, states.u[n, b], scratch)
    inertia.mass_matrix(component, scratch, D)
    matrix_of(states.q[n, b], R)
    V[:3] = R.T @ V[:3]
    return R, D, V


def _strain_energy(system: System, b: int, u: Array) -> float:
    if system.law[b] == LINEAR:
        return 0.5 * float(system.stiffness[b, : len(u)] @ u**2)
    if system.law[b] != STVK:
        raise ValueError("only linear and St. Venant-Kirchhoff bodies have an audit")
    r, p, start = len(u), int(system.points[b]), system.data_start[b]
    size = r + p * (p + 1) // 2
    A = system.data[start:][: size * size].reshape(size, size)
    w = u if p == r else system.data[start + size * size :][: p * r].reshape(p, r) @ u
    z = np.concatenate([u, np.outer(w, w)[np.triu_indices(p)]])
    return 0.5 * float(z @ A @ z)


def reach(character: Character) -> float:
    """What lengths of a character are measured by [m]: all arms of its joints together."""
    frames = [frame for joint in character.joints for frame in (joint.frame0, joint.frame1)]
    return max(sum(float(np.linalg.norm(frame.position)) for frame in frames), 0.1)
