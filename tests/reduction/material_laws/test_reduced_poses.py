"""Equilibria in reduced coordinates."""

import numpy as np
import pytest
from calmotion.reduction.material_laws.reduced_poses import equilibrium, stvk_force
from law_call import call_stvk


def gram_of(rng, r):
    size = r + r * (r + 1) // 2
    fields = rng.normal(size=(size, size))
    return fields @ fields.T / size


def test_the_readable_force_is_the_compiled_one():
    rng = np.random.default_rng(0)
    r = 5
    gram, u = gram_of(rng, r), rng.normal(size=r)
    force, stiffness = stvk_force(gram, u)
    res, P, K = np.zeros(6 + r), np.zeros((6 + r, 6 + r)), np.zeros((6 + r, 6 + r))
    call_stvk(gram, u, np.zeros(r), 0.0, True, res, P, K)
    assert np.allclose(force, res[6:], rtol=1e-12)
    assert np.allclose(stiffness, K[6:, 6:], rtol=1e-12)


def test_at_equilibrium_the_force_is_the_load():
    rng = np.random.default_rng(1)
    gram = gram_of(rng, 4)
    load = 0.1 * rng.normal(size=4)
    u = equilibrium(gram, load, np.zeros(4), steps=3)
    assert stvk_force(gram, u)[0] == pytest.approx(load, abs=1e-9)
