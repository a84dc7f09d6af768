"""Energy of a simulated character, and the work of its motors; from the inertia integrals and elastic laws."""

from __future__ import annotations

import numpy as np
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.kernels import inertia
from calmotion.multibody.kernels.components import component_of
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.kernels.work import allocate_work
from calmotion.multibody.model.system import LINEAR, STVK, System
from calmotion.simulation.forward import ForwardRun


def energy(system: System, states) -> tuple[np.ndarray, np.ndarray]:
    """Kinetic energy and all of it [J] at every instant, shape [T] each; laws linear or St. Venant-Kirchhoff."""
    kinetic, stored = np.zeros(len(states.c)), np.zeros(len(states.c))
    R, scratch = np.zeros((3, 3)), allocate_work(system)
    for b, r in enumerate(system.elastic):
        component, D = component_of.py_func(system, b), np.zeros((6 + r, 6 + r))
        for n in range(len(states.c)):
            u, V = states.u[n, b, :r], states.V[n, b, : 6 + r].copy()
            inertia.deformed_integrals(component, states.u[n, b], scratch)
            inertia.mass_matrix(component, scratch, D)
            matrix_of(states.q[n, b], R)
            V[:3] = R.T @ V[:3]
            kinetic[n] += 0.5 * V @ D @ V
            stored[n] += _strain_energy(system, b, u) - system.gravity @ (
                system.mass[b] * states.c[n, b] + R @ scratch.s
            )
    return kinetic, kinetic + stored


def _strain_energy(system: System, b: int, u: np.ndarray) -> float:
    if system.law[b] == LINEAR:
        return 0.5 * float(system.stiffness[b, : len(u)] @ u**2)
    assert system.law[b] == STVK
    r, p, start = len(u), int(system.points[b]), system.data_start[b]
    size = r + p * (p + 1) // 2
    A = system.data[start:][: size * size].reshape(size, size)
    w = u if p == r else system.data[start + size * size :][: p * r].reshape(p, r) @ u
    z = np.concatenate([u, np.outer(w, w)[np.triu_indices(p)]])
    return 0.5 * float(z @ A @ z)


def work(system: System, run: ForwardRun) -> np.ndarray:
    """Work of the motors since the first instant [J], shape [T]."""
    efforts = reactions(system, run.trajectory, run.joint_angles, run.joint_rates).efforts
    power = np.sum(efforts * run.joint_rates, axis=1)
    return np.concatenate([[0.0], np.cumsum(0.5 * run.trajectory.h * (power[1:] + power[:-1]))])
