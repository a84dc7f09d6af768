"""Second-order forces and the Gram matrix of strains against energies by another quadrature."""

import numpy as np
import pytest
from boxes import box_tets, conical_quadrature
from calmotion.model import ElasticMaterial
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.elastic_forms import GradientRule, lame_constants, linear_stress, strain_gram

MATERIAL = ElasticMaterial("/Looks/Any", 3.0, 0.3, 1.0)
LAME, MU = lame_constants(3.0, 0.3)


@pytest.fixture(scope="module")
def body():
    points, tets = box_tets((2, 1, 1), (0.5, 0.3, 0.2))
    return assemble(points, tets, MATERIAL), *conical_quadrature(points, tets, order=5)


def gradients(model, bary, field):
    """Displacement gradient of a nodal field at points of given barycentric coordinates, from the shape functions."""
    corners = model.mesh.nodes[model.mesh.tets[:, :4]]
    edges = corners[:, 1:] - corners[:, :1]
    inverse = np.linalg.inv(edges)  # [m, xyz, 3 natural], d(natural)/dX transposed
    slopes = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)  # d(bary_k)/dX, [m, 3, 4]
    pairs = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    out = np.zeros((len(corners), len(bary), 3, 3))
    for q, L in enumerate(bary):
        shape = [(4 * L[k] - 1) * slopes[:, :, k] for k in range(4)]
        shape += [4 * (L[i] * slopes[:, :, j] + L[j] * slopes[:, :, i]) for i, j in pairs]
        out[:, q] = np.einsum("eai,aej->eij", field[model.mesh.tets], np.array(shape))
    return out


def energy(law, F):
    if law == "stvk":
        E = 0.5 * (np.swapaxes(F, -1, -2) @ F - np.eye(3))
        return 0.5 * LAME * np.trace(E, axis1=-2, axis2=-1) ** 2 + MU * np.einsum("...ij,...ij->...", E, E)
    J = np.linalg.det(F)
    I1 = np.einsum("...ij,...ij->...", F, F)
    return 0.5 * MU * (I1 - 3.0) - MU * np.log(J) + 0.5 * LAME * np.log(J) ** 2


def test_the_gram_matrix_gives_the_energy_of_any_state(body):
    model, bary, weights = body
    rng = np.random.default_rng(2)
    modes = rng.normal(size=(len(model.mesh.nodes), 3, 4))
    A = strain_gram(GradientRule(model.mesh, 5), modes, LAME, MU)
    for size in (0.01, 1.0):
        u = size * rng.normal(size=4)
        z = np.concatenate([u, np.outer(u, u)[np.triu_indices(4)]])
        expected = np.sum(weights * energy("stvk", np.eye(3) + gradients(model, bary, modes @ u)))
        assert 0.5 * z @ A @ z == pytest.approx(expected, rel=1e-11)
    # its first block is the stiffness of the assembled matrix
    flat = modes.reshape(-1, 4)
    assert np.allclose(A[:4, :4], flat.T @ (model.stiffness @ flat), rtol=1e-11)
    assert np.linalg.eigvalsh(A)[0] > -1e-10 * np.abs(A).max()


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_the_second_order_force_is_the_third_derivative_of_the_energy(body, law):
    model, bary, weights = body
    rng = np.random.default_rng(3)
    a, b, d = rng.normal(size=(3, len(model.mesh.nodes), 3))
    rule = GradientRule(model.mesh, 5)
    G = rule.gradients(np.stack([a, b], axis=-1))
    ours = np.sum(rule.second_order_force(G[0], G[1], LAME, MU, law) * d)
    h = 1e-3 / max(np.abs(gradients(model, bary, x)).max() for x in (a, b, d))

    def at(i, j, k):
        return np.sum(weights * energy(law, np.eye(3) + gradients(model, bary, h * (i * a + j * b + k * d))))

    signs = (-1, 1)
    third = sum(i * j * k * at(i, j, k) for i in signs for j in signs for k in signs) / (8 * h**3)
    assert ours == pytest.approx(third, rel=1e-3)


def test_the_linear_stress_is_hookes():
    G = np.diag([1e-3, 0.0, 0.0])
    stress = linear_stress(G, LAME, MU)
    assert stress[0, 0] == pytest.approx((LAME + 2 * MU) * 1e-3)
    assert stress[1, 1] == stress[2, 2] == pytest.approx(LAME * 1e-3)
