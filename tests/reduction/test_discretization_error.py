"""The estimated error of frequencies against meshes that are finer."""

import numpy as np
import pytest
from calmotion.reduction.basis.natural_modes import clamped_modes
from calmotion.reduction.discretization_error import element_errors, energy_errors, frequency_errors
from calmotion.reduction.elements.assembly import assemble


def held(model):
    return np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9)


@pytest.mark.parametrize(
    ("size", "coarse", "fine"),
    [
        ((0.8, 0.04, 0.04), (20, 1, 1), (60, 4, 4)),
        ((0.2, 0.04, 0.04), (12, 2, 2), (30, 6, 6)),
        pytest.param((0.4, 0.4, 0.02), (12, 12, 1), (24, 24, 2), marks=pytest.mark.long),
    ],
    ids=["slender beam", "stubby beam", "plate"],
)
def test_the_estimate_covers_the_true_error_and_is_not_far_above_it(helpers, plastic, size, coarse, fine):
    model, finer = (assemble(*helpers.box(counts, size), plastic) for counts in (coarse, fine))
    found, estimate = frequency_errors(model, plastic, 1, held(model))
    true = found / clamped_modes(finer, 1, held(finer))[0] - 1.0
    assert true[0] > 1e-4
    assert true[0] < estimate[0] < 5.0 * true[0]


def test_the_estimate_decreases_with_the_mesh_size_and_faster_without_a_clamp(helpers, plastic):
    free, clamped = [], []
    for n in (1, 2):
        model = assemble(*helpers.box((10 * n, 2 * n, 2 * n), (0.2, 0.04, 0.04)), plastic)
        free.append(frequency_errors(model, plastic, 1)[1][0])
        clamped.append(frequency_errors(model, plastic, 1, held(model))[1][0])
    assert free[0] / free[1] > 6.0  # of order four on smooth modes, near enough
    assert 1.5 < clamped[0] / clamped[1] < free[0] / free[1]


def test_a_displacement_with_linear_strains_has_no_error(helpers, steel):
    """Pure bending with its anticlastic curvature: quadratic, so the elements hold it exactly."""
    mesh = assemble(*helpers.box((5, 3, 3), (0.3, 0.05, 0.04)), steel).mesh
    x, y, z = (mesh.nodes - mesh.nodes.mean(axis=0)).T
    nu = steel.poissons_ratio
    u = np.stack([x * z, -nu * y * z, -0.5 * (x**2 + nu * (z**2 - y**2))], axis=1)[:, :, None]
    assert energy_errors(mesh, steel, u)[0] < 1e-20


def test_rough_strains_have_one(helpers, steel):
    mesh = assemble(*helpers.box((5, 3, 3), (0.3, 0.05, 0.04)), steel).mesh
    u = np.random.default_rng(0).standard_normal((len(mesh.nodes), 3, 2))
    assert (energy_errors(mesh, steel, u) > 0.1).all()


def test_no_displacements_have_no_errors(helpers, steel):
    model = assemble(*helpers.box((2, 1, 1), (0.2, 0.1, 0.1)), steel)
    errors = element_errors(model.mesh, steel, np.zeros((len(model.mesh.nodes), 3, 0)))
    assert errors.shape == (len(model.mesh.tets), 0)
