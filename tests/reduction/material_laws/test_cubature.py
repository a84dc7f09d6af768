"""Cubature against the sum over all elements."""

import numpy as np
import pytest
from boxes import box_tets
from calmotion.errors import ShotError
from calmotion.model import FlexibleSettings
from calmotion.multibody.kernels.neohookean import JOIN
from calmotion.reduction.basis.craig_bampton import reduced_basis
from calmotion.reduction.basis.modal_derivatives import Support, extended_basis
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.elastic_forms import GradientRule, lame_constants
from calmotion.reduction.material_laws import cubature
from calmotion.reduction.material_laws.cubature import (
    LEAST_VOLUME,
    linear_tangent,
    neohookean_cubature,
    neohookean_stress,
)
from law_call import call_neohookean


@pytest.fixture(scope="module")
def arm(plastic):
    points, tets = box_tets((16, 2, 2), (0.4, 0.03, 0.02))
    model = assemble(points, tets, plastic)
    x = model.mesh.nodes[:, 0]
    support = Support(np.flatnonzero(x < 1e-9), [np.flatnonzero(x > 0.4 - 1e-9)], [np.array([0.4, 0.015, 0.01])])
    settings = FlexibleSettings(plastic, mode_count=6)
    basis = reduced_basis(model, support.root, support.patches, support.centers, settings)
    return model, extended_basis(model, support, basis, 4, plastic, "neohookean"), plastic


def reduced(r, data, points, lame, mu, u):
    res, P, K = np.zeros(6 + r), np.zeros((6 + r, 6 + r)), np.zeros((6 + r, 6 + r))
    call_neohookean(points, u, np.zeros(r), (lame, mu), 0.0, data, True, res, P, K)
    return res[6:], K[6:, 6:]


def test_few_cubature_points_deflect_the_arm_as_all_do(arm):
    model, basis, material = arm
    r = len(basis.omega_squared)
    lame, mu = lame_constants(material.youngs_modulus, material.poissons_ratio)
    data, points = neohookean_cubature(model, basis, material)
    rule = GradientRule(model.mesh, 2)
    G = rule.gradients(basis.modes).reshape(r, -1, 9).transpose(1, 2, 0)
    everything = np.hstack([rule.weights.reshape(-1, 1), G.reshape(len(G), -1)])
    whole = np.concatenate([np.zeros(r * r), everything.ravel()])
    assert points < 0.15 * len(G)
    # about the undeformed state the stiffness is exact
    K = reduced(r, data, points, lame, mu, np.zeros(r))[1]
    assert np.allclose(K, np.diag(basis.omega_squared), atol=1e-9 * basis.omega_squared[-1])
    load = basis.patch_motion[0, 2] * 100.0
    tips = []
    for values, count in ((data, points), (whole, len(G))):
        u = np.zeros(r)
        for part in np.linspace(0.1, 1.0, 10):
            for _ in range(30):
                force, stiffness = reduced(r, values, count, lame, mu, u)
                u = u + np.linalg.solve(stiffness, part * load - force)
        assert np.abs(reduced(r, values, count, lame, mu, u)[0] - load).max() < 1e-6 * np.abs(load).max()
        tips.append(basis.patch_motion[0, :3] @ u)
    assert np.linalg.norm(tips[1]) > 0.05  # an eighth of its length
    assert np.linalg.norm(tips[0] - tips[1]) < 0.01 * np.linalg.norm(tips[1])


def test_a_body_that_no_points_fit_is_refused(arm, monkeypatch):
    model, basis, material = arm
    monkeypatch.setattr(cubature, "_MOST", 5)
    with pytest.raises(ShotError, match="no cubature"):
        neohookean_cubature(model, basis, material)


def test_the_stress_is_linear_elasticity_at_first_order():
    rng = np.random.default_rng(0)
    G = 1e-6 * rng.normal(size=(3, 3))
    assert np.allclose(
        neohookean_stress(np.eye(3) + G, 2.0, 0.7).ravel(), linear_tangent(2.0, 0.7) @ G.ravel(), atol=1e-10
    )


def test_the_stress_is_that_of_the_compiled_law_also_where_an_element_is_inside_out():
    rng = np.random.default_rng(6)
    assert LEAST_VOLUME == JOIN
    for size in (0.1, 1.0, 3.0):
        G = size * rng.normal(size=(9, 9))
        data = np.concatenate([np.zeros(81), [1.0], G.ravel()])
        u = rng.normal(size=9)
        F = np.eye(3) + (G @ u).reshape(3, 3)
        force, _ = reduced(9, data, 1, 2.0, 0.7, u)
        assert np.allclose(force, G.T @ neohookean_stress(F, 2.0, 0.7).ravel(), rtol=1e-10)
