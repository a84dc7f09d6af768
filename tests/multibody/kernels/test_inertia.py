"""One component's inertia against sums over particles, which know nothing of the integrals (identities 1 and 3)."""

import numpy as np
import pytest
from calmotion.multibody.kernels import inertia
from calmotion.multibody.kernels.components import ComponentMotion
from calmotion.multibody.kernels.work import allocate_work
from particles import by_particles, component_of, particle_system


def component(r, seed=0):
    rng = np.random.default_rng(seed)
    system, parts = particle_system(rng, [-1], [r])
    u, v, vd = (rng.normal(size=r) * scale for scale in (0.3, 1.0, 2.0))
    a, om, al = rng.normal(size=(3, 3))
    work = allocate_work(system)
    inertia.deformed_integrals(component_of(system, 0), u, work)
    return system, parts[0], (a, om, al, u, v, vd), work


def residual(system, r, state, work):
    res = np.zeros(6 + r)
    inertia.body_residual(component_of(system, 0), ComponentMotion(*state), work, res)
    return res


@pytest.mark.parametrize("r", [0, 1, 4, 9])
def test_rows_are_the_virtual_work_of_the_particles(r):
    system, part, state, work = component(r)
    expected = by_particles(system, part, state)
    assert np.abs(residual(system, r, state, work) - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("r", [0, 5])
def test_mass_matrix_gives_the_kinetic_energy_and_the_acceleration_terms(r):
    system, part, state, work = component(r)
    a, om, al, u, v, vd = state
    D = np.zeros((6 + r, 6 + r))
    inertia.mass_matrix(component_of(system, 0), work, D)
    assert np.abs(D - D.T).max() < 1e-15
    V = np.concatenate([a, om, v])  # `a` stands for the velocity of the origin, body axes
    velocity = a + np.cross(om, part.points + part.modes @ u) + part.modes @ v
    energy = 0.5 * np.sum(part.masses[:, None] * velocity**2)
    assert abs(0.5 * V @ D @ V - energy) < 1e-12 * energy
    zero = (np.zeros(3), om, np.zeros(3), u, v, np.zeros(r))
    change = residual(system, r, state, work) - residual(system, r, zero, work)
    assert np.abs(D @ np.concatenate([a, al, vd]) - change).max() < 1e-12 * np.abs(change).max()


def test_power_of_the_rows_is_the_rate_of_energy():
    """V . rows without gravity is d/dt (kinetic + elastic energy) plus what damping dissipates."""
    r = 4
    system, part, (a, om, al, u, v, vd), work = component(r)
    w = np.array([0.4, -0.7, 0.2])
    k, d = system.stiffness[0, :r], system.damping[0, :r, :r]

    def energy(t):
        # everything in axes turning with the body: the origin's acceleration in them is a - om x w
        wt, omt, vt = w + t * (a - np.cross(om, w)), om + t * al, v + t * vd
        ut = u + t * v
        velocity = wt + np.cross(omt, part.points + part.modes @ ut) + part.modes @ vt
        return 0.5 * np.sum(part.masses[:, None] * velocity**2) + 0.5 * np.sum(k * ut**2)

    e = 1e-5
    rate = (energy(e) - energy(-e)) / (2 * e)
    rows = residual(system, r, (a, om, al, u, v, vd), work)
    power = np.concatenate([w, om, v]) @ rows - v @ d @ v
    assert abs(power - rate) < 1e-8 * abs(rate)


@pytest.mark.parametrize("r", [0, 1, 6])
def test_jacobians_match_central_differences(r):
    system, part, state, work = component(r)
    a, om, al, u, v, vd = state
    n, e = 6 + r, 1e-6
    residual(system, r, state, work)
    one, motion = component_of(system, 0), ComponentMotion(*state)
    D, P, K = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    inertia.mass_matrix(one, work, D)
    inertia.velocity_jacobian(one, motion, work, P)
    inertia.position_jacobian(one, motion, work, D, K)

    def rows(da=0.0, dom=0.0, du=0.0, dv=0.0):
        return by_particles(system, part, (a + da, om + dom, al, u + du, v + dv, vd))

    for k in range(3):
        d = np.eye(3)[k]
        assert np.abs((rows(dom=e * d) - rows(dom=-e * d)) / (2 * e) - P[:, 3 + k]).max() < 1e-7
        turn = np.cross(a, d)
        assert np.abs((rows(da=e * turn) - rows(da=-e * turn)) / (2 * e) - K[:, 3 + k]).max() < 1e-7
    for k in range(r):
        d = np.eye(r)[k]
        assert np.abs((rows(dv=e * d) - rows(dv=-e * d)) / (2 * e) - P[:, 6 + k]).max() < 1e-7
        assert np.abs((rows(du=e * d) - rows(du=-e * d)) / (2 * e) - K[:, 6 + k]).max() < 1e-7
    assert not P[:, :3].any() and not K[:, :3].any()
