"""A plane beam on a driven hinge, in coordinates of the world: what a slender link does in a motion of any deflection.

t, tip = swing(length, beam, load, angle, step=5e-4, duration=0.45)   # tip: along and across the hinge's direction
"""

from typing import NamedTuple

import numpy as np

_POINTS = np.array([-1.0, 1.0]) / np.sqrt(3.0)  # two on three nodes: exact but for locking


class Beam(NamedTuple):
    """Stiffness in stretch, shear [N] and bending [N m^2]; mass [kg/m] and moment of inertia of a section [kg m]."""

    EA: float
    GA: float
    EI: float
    mass: float
    turning: float


def square_beam(modulus, density, thickness):
    """A square section without Poisson's ratio."""
    area, second = thickness**2, thickness**4 / 12.0
    return Beam(modulus * area, 5.0 / 6.0 * modulus / 2.0 * area, modulus * second, density * area, density * second)


def swing(length, beam, load, angle, step, duration, elements=20):
    """Times [s], and the tip along and across the direction of the hinge [m], shape [t, 2].

    Nodes have a place and an angle of their section, so that large rotations need no floating frame. By the trapezoidal
    rule, without gravity.

    Args:
        load: Mass [kg] and moment of inertia [kg m^2] at the tip.
        angle: Of the hinge over time [rad], at rest at first.

    Source: Simo and Vu-Quoc, On the dynamics of flexible beams under large overall motions, the plane case, 1986.
    """
    count = 2 * elements + 1
    rows = 3 * (2 * np.arange(elements)[:, None] + np.arange(3))[:, :, None] + np.arange(3)
    rows = rows.reshape(elements, 9)
    M = _mass(beam, length / elements, rows, 3 * count)
    M[-3:, -3:] += np.diag([load[0], load[0], load[1]])
    q, v, a = np.zeros((count, 3)), np.zeros(3 * count), np.zeros(3 * count)
    q[:, 0] = np.linspace(0.0, length, count)
    q = q.ravel()
    times = step * np.arange(round(duration / step) + 1)
    tips = [q[-3:-1]]
    for t in times[1:]:
        before, q = q, q + step * v
        q[:3] = 0.0, 0.0, angle(t)
        for _ in range(20):
            accelerated = 4.0 / step**2 * (q - before - step * v) - a
            f, K = _forces(beam, length / elements, rows, q)
            residual = (f + M @ accelerated)[3:]
            change = np.linalg.solve((K + 4.0 / step**2 * M)[3:, 3:], residual)
            q[3:] -= change
            if np.abs(change).max() < 1e-11 * length:
                break
        else:
            raise ArithmeticError(f"no step at {t} s; take smaller ones")
        accelerated = 4.0 / step**2 * (q - before - step * v) - a
        v, a = v + 0.5 * step * (a + accelerated), accelerated
        tips.append(q[-3:-1])
    x, z = np.array(tips).T
    turn = angle(times)
    return times, np.column_stack([np.cos(turn) * x + np.sin(turn) * z, np.cos(turn) * z - np.sin(turn) * x])


def _mass(beam, size, rows, n):
    M, shapes = np.zeros((n, n)), np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]]) / 30.0 * size
    own = np.kron(shapes, np.diag([beam.mass, beam.mass, beam.turning]))
    for at in rows:
        M[np.ix_(at, at)] += own
    return M


def _forces(beam, size, rows, q):
    """Internal forces and their derivatives, in coordinates (x, z, angle) of each node."""
    f, K, own = np.zeros(len(q)), np.zeros((len(q), len(q))), q[rows].reshape(len(rows), 3, 3)
    stiffness = np.array([beam.EA, beam.GA, beam.EI])
    for s in _POINTS:
        shape = np.array([0.5 * s * (s - 1.0), 1.0 - s * s, 0.5 * s * (s + 1.0)])
        slope = np.array([s - 0.5, -2.0 * s, s + 0.5]) * 2.0 / size
        weight = 0.5 * size
        along, turn = slope @ own[:, :, :2], own[:, :, 2] @ shape
        cos, sin = np.cos(turn), np.sin(turn)
        stretch, shear = cos * along[:, 0] + sin * along[:, 1], cos * along[:, 1] - sin * along[:, 0]
        B = np.zeros((len(rows), 3, 3, 3))  # strain, node, coordinate
        B[:, 0, :, 0], B[:, 0, :, 1], B[:, 0, :, 2] = np.outer(cos, slope), np.outer(sin, slope), np.outer(shear, shape)
        B[:, 1, :, 0], B[:, 1, :, 1] = np.outer(-sin, slope), np.outer(cos, slope)
        B[:, 1, :, 2] = np.outer(-stretch, shape)
        B[:, 2, :, 2] = slope
        B = B.reshape(len(rows), 3, 9)
        n = stiffness * np.column_stack([stretch - 1.0, shear, own[:, :, 2] @ slope])
        # force times the second derivatives of stretch and shear
        G = np.zeros((len(rows), 3, 3, 3, 3))
        sides = (-sin * n[:, 0] - cos * n[:, 1], cos * n[:, 0] - sin * n[:, 1])
        for k, side in enumerate(sides):
            mixed = side[:, None, None] * np.outer(slope, shape)
            G[:, :, k, :, 2] += mixed
            G[:, :, 2, :, k] += mixed.swapaxes(1, 2)
        G[:, :, 2, :, 2] -= (n[:, 0] * stretch + n[:, 1] * shear)[:, None, None] * np.outer(shape, shape)
        tangent = np.einsum("eki,k,ekj->eij", B, stiffness, B) + G.reshape(len(rows), 9, 9)
        np.add.at(f, rows, weight * np.einsum("eki,ek->ei", B, n))
        np.add.at(K, (rows[:, :, None], rows[:, None, :]), weight * tangent)
    return f, K
