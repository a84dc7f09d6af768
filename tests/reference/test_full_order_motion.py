"""The unreduced body by itself: what its motion must keep, and what its materials and loads must do."""

import numpy as np
import pytest
from boxes import box_tets
from full_order import FullOrder

E, NU, RHO = 1e6, 0.3, 1000.0
SIZE = np.array([0.4, 0.1, 0.1])


def block(law="stvk", **options):
    points, tets = box_tets((4, 1, 1), SIZE, -SIZE / 2)
    return FullOrder(points, tets, options.pop("modulus", E), NU, options.pop("density", RHO), law, **options)


def thrown(body, step, duration, **options):
    """States of a free block that is thrown, turns about two axes and is squeezed; energies and momenta."""
    X = body.nodes
    v = np.array([0.3, -0.2, 0.5]) + np.cross([1.0, 6.0, 2.0], X) + 2.0 * X * [1.0, -0.4, -0.4]
    states = list(body.march(X, v, step, round(duration / step), **options))
    M = body.mass
    energy = [0.5 * s.v.ravel() @ (M @ s.v.ravel()) + body.energy(s.x) for s in states]
    momentum = [(M @ s.v.ravel()).reshape(-1, 3).sum(axis=0) for s in states]
    spin = [np.cross(s.x, (M @ s.v.ravel()).reshape(-1, 3)).sum(axis=0) for s in states]
    return states, np.array(energy), np.array(momentum), np.array(spin)


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_a_thrown_block_keeps_its_momenta_and_its_energy(law):
    body = block(law)
    drift = []
    for step in (1e-3, 5e-4):
        _, energy, momentum, spin = thrown(body, step, 0.05, steady=1.0)
        assert np.abs(momentum - momentum[0]).max() < 1e-7 * np.abs(momentum[0]).max()
        drift.append([np.abs(energy / energy[0] - 1.0).max(), np.abs(spin - spin[0]).max() / np.abs(spin[0]).max()])
    stored = body.energy(thrown(body, 1e-3, 0.01, steady=1.0)[0][-1].x)
    assert stored > 1e-3 * energy[0]  # it does deform
    first, second = np.array(drift)
    assert (second < 5e-3).all() and (first > 3.0 * second).all()


def test_only_what_deforms_is_damped():
    lazy = block(retardation=2e-3)
    assert np.allclose(lazy.forces(lazy.nodes, False, np.cross([1.0, 2.0, 3.0], lazy.nodes) + 1.0)[0], 0.0, atol=1e-9)
    _, kept, *_ = thrown(block(), 1e-3, 0.05)
    states, energy, momentum, spin = thrown(lazy, 1e-3, 0.05)
    assert np.abs(momentum - momentum[0]).max() < 1e-7 * np.abs(momentum[0]).max()
    assert np.abs(spin - spin[0]).max() < 5e-3 * np.abs(spin[0]).max()
    assert energy[-1] < 0.99 * energy[0] and kept[-1] > 0.995 * kept[0]


def test_a_stretching_bar_is_damped_as_an_oscillator():
    """The lowest stretching of a slender bar that is held: half the retardation times omega, of critical."""
    points, tets = box_tets((8, 1, 1), (1.0, 0.04, 0.04), (0.0, -0.02, -0.02))
    bar = FullOrder(points, tets, E, 0.0, RHO, retardation=4e-3)
    held = np.flatnonzero(bar.nodes[:, 0] < 1e-9)
    omega = 0.5 * np.pi * np.sqrt(E / RHO)
    start = bar.nodes + 1e-5 * np.sin(0.5 * np.pi * bar.nodes[:, :1]) * [1.0, 0.0, 0.0]
    step, tip = 2.0 * np.pi / omega / 200, int(bar.nodes[:, 0].argmax())
    move = np.array([s.x[tip, 0] for s in bar.march(start, np.zeros_like(start), step, 250, held=held)]) - 1.0
    ratio = 0.5 * bar.retardation * omega
    t = step * np.arange(251)
    turning = omega * np.sqrt(1.0 - ratio**2)
    expected = np.exp(-ratio * omega * t) * (np.cos(turning * t) + ratio * omega / turning * np.sin(turning * t))
    assert np.abs(move / 1e-5 - expected).max() < 5e-3
