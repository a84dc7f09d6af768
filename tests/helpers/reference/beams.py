"""Theories of beams that the solids are held against, solved by themselves."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq


def pushed_beam(force, length, EA, GA, EI):
    """A clamped beam of any deflection under a force [N] across its end, which keeps its direction.

    Returns:
        How far the end moves along and across [m], and its slope [rad].

    Source: Reissner 1972, plane beams with stretch, shear and bending; integrated from the clamp, whose moment is
    found by shooting.
    """

    def slope(s, y):
        theta, moment = y[:2]
        stretch, shear = 1.0 + force * np.sin(theta) / EA, force * np.cos(theta) / GA
        x = np.cos(theta) * stretch - np.sin(theta) * shear
        return [moment / EI, -force * x, x, np.sin(theta) * stretch + np.cos(theta) * shear]

    def end(moment):
        return solve_ivp(slope, (0.0, length), [0.0, moment, 0.0, 0.0], rtol=1e-10, atol=1e-12).y[:, -1]

    moment = brentq(lambda m: end(m)[1], 0.0, 1.01 * force * length, rtol=1e-12)
    theta, _, x, z = end(moment)
    return x - length, z, theta


def timoshenko_frequencies(material, length, height, count):
    """Clamped-free Timoshenko beam of a square section, first bending frequencies [Hz]: roots of the transfer
    matrix's determinant.

    State (w, psi, moment M, shear Q): w' = psi + Q / kGA, psi' = M / EI, M' = -Q - rho I omega^2 psi,
    Q' = -rho A omega^2 w, where psi turns the section. Shear factor of a rectangle by Cowper 1966.
    """
    E, nu, rho = material.youngs_modulus, material.poissons_ratio, material.density
    A, second = height**2, height**4 / 12.0
    shear = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu) * E / (2.0 * (1.0 + nu)) * A

    def end(omega):
        o2 = omega**2
        transfer = np.array(
            [
                [0.0, 1.0, 0.0, 1.0 / shear],
                [0.0, 0.0, 1.0 / (E * second), 0.0],
                [0.0, -rho * second * o2, 0.0, -1.0],
                [-rho * A * o2, 0.0, 0.0, 0.0],
            ]
        )
        scale = np.array([length, 1.0, E * second / length, E * second / length**2])
        T = expm(transfer * (scale[None, :] / scale[:, None]) * length)
        return np.linalg.det(T[2:, 2:])

    base = np.sqrt(E * second / (rho * A * length**4))
    grid = np.linspace(0.5, 70.0, 700) * base
    values = [end(omega) for omega in grid]
    roots = [
        brentq(end, a, b) for a, b, fa, fb in zip(grid, grid[1:], values, values[1:], strict=False) if fa * fb < 0.0
    ]
    return np.array(roots[:count]) / (2.0 * np.pi)
