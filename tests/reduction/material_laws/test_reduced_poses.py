"""Equilibria in reduced coordinates."""

import numpy as np
import pytest
from calmotion.reduction.material_laws.reduced_poses import equilibrium, stvk_force


def gram_of(rng, r):
    size = r + r * (r + 1) // 2
    fields = rng.normal(size=(size, size))
    return fields @ fields.T / size


def test_at_equilibrium_the_force_is_the_load():
    rng = np.random.default_rng(1)
    gram = gram_of(rng, 4)
    load = 0.1 * rng.normal(size=4)
    u = equilibrium(gram, load, np.zeros(4), steps=3)
    assert stvk_force(gram, u)[0] == pytest.approx(load, abs=1e-9)
