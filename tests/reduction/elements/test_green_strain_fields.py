"""Strain fields of modes and pairs against strains of one displacement at a time."""

import numpy as np
from calmotion.reduction.elements.green_strain_fields import green_fields


def test_their_inner_products_are_the_energy_of_the_strain():
    rng = np.random.default_rng(4)
    r, p, n, lame, mu = 4, 3, 5, 1.7, 0.6
    G, W = rng.normal(size=(r, n, 3, 3)), rng.normal(size=(p, r))
    turns = np.einsum("pk,knij->pnij", W, G)
    weight = rng.uniform(0.5, 1.5, n)
    shear = np.sqrt(2 * mu)
    fields = np.full((r + p * (p + 1) // 2, 6, n), np.nan)
    packed = [np.ascontiguousarray(A.reshape(len(A), n, 9).transpose(0, 2, 1)) for A in (G, turns)]
    green_fields(*packed, np.sqrt(weight), shear, (np.sqrt(2 * mu + 3 * lame) - shear) / 3, fields)
    # coordinates of a state, the directions' part of which need not follow from the rest
    u, w = rng.normal(size=r), rng.normal(size=p)
    linear, quadratic = np.einsum("k,knij->nij", u, G), np.einsum("k,knij->nij", w, turns)
    E = 0.5 * (linear + linear.swapaxes(1, 2) + quadratic.swapaxes(1, 2) @ quadratic)
    density = mu * np.einsum("nij,nij->n", E, E) + 0.5 * lame * np.trace(E, axis1=1, axis2=2) ** 2
    z = np.concatenate([u, np.outer(w, w)[np.triu_indices(p)]])
    stored = np.tensordot(z, fields, 1)
    np.testing.assert_allclose(0.5 * np.sum(stored**2), weight @ density, rtol=1e-13)
