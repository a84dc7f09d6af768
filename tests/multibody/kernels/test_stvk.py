"""Forces of nonlinear bodies against their energies and against direct quadrature."""

import numpy as np
import pytest
from calmotion.multibody.kernels.neohookean import JOIN
from law_call import call_neohookean, call_stvk


class Law:
    """A law of random data with its scratch: `forces(u, v)` gives force, d/dv, d/du; `energy(u)`."""

    beta = 0.0

    def __init__(self, rng, r, beta=0.0):
        self.r, self.beta = r, beta
        self.make(rng)

    def forces(self, u, v=None):
        r = self.r
        v = np.zeros(r) if v is None else v
        res, P, K = np.zeros(6 + r), np.zeros((6 + r, 6 + r)), np.zeros((6 + r, 6 + r))
        self.call(u, v, True, res, P, K)
        alone = np.zeros(6 + r)
        self.call(u, v, False, alone, P.copy(), K.copy())
        assert np.abs(alone - res).max() <= 1e-13 * np.abs(res).max()
        for array in (res[:6], P[:6], K[:6], P[:, :6], K[:, :6]):
            assert not array.any()
        return res[6:], P[6:, 6:], K[6:, 6:]


class StVenantKirchhoff(Law):
    def make(self, rng):
        size = self.r + self.r * (self.r + 1) // 2
        fields = rng.normal(size=(size, 2 * size))
        self.A = fields @ fields.T / size

    def z(self, u):
        return np.concatenate([u, np.outer(u, u)[np.triu_indices(self.r)]])

    def energy(self, u):
        return 0.5 * self.z(u) @ self.A @ self.z(u)

    def call(self, u, v, tangent, res, P, K):
        call_stvk(self.A, u, v, self.beta, tangent, res, P, K, before=3)


class SeenInPart(Law):
    """Its quadratic strain sees two directions of its coordinates."""

    def make(self, rng):
        size = self.r + 3
        fields = rng.normal(size=(size, 2 * size))
        self.A = fields @ fields.T / size
        self.W = rng.normal(size=(2, self.r))

    def energy(self, u):
        w = self.W @ u
        z = np.concatenate([u, [w[0] * w[0], w[0] * w[1], w[1] * w[1]]])
        return 0.5 * z @ self.A @ z

    def call(self, u, v, tangent, res, P, K):
        call_stvk(self.A, u, v, self.beta, tangent, res, P, K, seen=self.W, before=2)


class NeoHookean(Law):
    lame, mu = 3.0, 1.3

    def make(self, rng):
        self.weights = rng.uniform(0.1, 1.0, 5)
        self.G = rng.normal(size=(5, 3, 3, self.r)) * 0.3
        C = rng.normal(size=(self.r, self.r))
        self.C = C + C.T

    def deformation(self, u):
        return np.eye(3) + self.G @ u

    def energy(self, u):
        F = self.deformation(u)
        J = np.linalg.det(F)
        x = (J - JOIN) / JOIN
        L = np.where(J >= JOIN, np.log(np.maximum(J, JOIN)), np.log(JOIN) + x - 0.5 * x * x)
        W = 0.5 * self.mu * (np.einsum("nij,nij->n", F, F) - 3.0) - self.mu * L + 0.5 * self.lame * L * L
        return self.weights @ W + 0.5 * u @ self.C @ u

    def call(self, u, v, tangent, res, P, K):
        points = np.hstack([self.weights[:, None], self.G.reshape(5, -1)])
        data = np.concatenate([np.full(2, np.nan), self.C.ravel(), points.ravel()])
        call_neohookean(5, u, v, (self.lame, self.mu), self.beta, data, tangent, res, P, K, start=2)


def gradient(function, x, h=1e-3):
    """Derivative by differences of eighth order, shape of the value + [n]."""
    weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
    columns = []
    for e in np.eye(len(x)):
        columns.append(
            sum(w * (np.asarray(function(x + k * h * e)) - function(x - k * h * e)) for k, w in weights.items()) / h
        )
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("law", [StVenantKirchhoff, SeenInPart, NeoHookean])
@pytest.mark.parametrize("size", [0.1, 1.0, 4.0])
def test_the_force_is_the_gradient_of_the_energy_and_the_stiffness_its_jacobian(law, size):
    rng = np.random.default_rng(int(10 * size))
    item = law(rng, 4)
    u = size * rng.normal(size=4)
    force, _, stiffness = item.forces(u)
    assert np.isfinite(force).all()
    # steps that stay on one side of the join of the Neo-Hookean law, where its third derivative jumps
    expected = gradient(item.energy, u, 1e-3)
    assert np.allclose(force, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    expected = gradient(lambda x: item.forces(x)[0], u, 1e-3)
    assert np.allclose(stiffness, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("law", [StVenantKirchhoff, SeenInPart, NeoHookean])
def test_derivatives_of_the_damped_force(law):
    rng = np.random.default_rng(3)
    item = law(rng, 3, beta=0.2)
    u, v = rng.normal(size=3), rng.normal(size=3)
    _, by_v, by_u = item.forces(u, v)
    expected_v = gradient(lambda x: item.forces(u, x)[0], v)
    expected_u = gradient(lambda x: item.forces(x, v)[0], u)
    assert np.allclose(by_v, expected_v, rtol=0, atol=1e-8 * np.abs(expected_v).max())
    assert np.allclose(by_u, expected_u, rtol=0, atol=1e-8 * np.abs(expected_u).max())
    # damping takes energy, in every state
    assert v @ (item.forces(u, v)[0] - item.forces(u)[0]) > 0.0


def test_inverted_elements_are_pushed_back():
    rng = np.random.default_rng(5)
    item = NeoHookean(rng, 1)
    item.weights[:], item.C[:] = 1.0, 0.0
    item.G[:] = np.diag([1.0, 0.0, 0.0])[None, :, :, None]  # F = diag(1 + u, 1, 1)
    states = np.linspace(-4.0, -0.01, 400)
    forces = np.array([item.forces(np.array([u]))[0][0] for u in states])
    assert np.isfinite(forces).all() and (forces < 0.0).all()
    # and across the join nothing jumps
    assert np.abs(np.diff(forces)).max() < 0.1 * np.abs(forces).max()
