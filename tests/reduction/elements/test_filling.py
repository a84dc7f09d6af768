"""Elements across the skin and the core of a print: exact for linear strains, right on meshes that ignore the skin."""

import numpy as np
import pytest
from calmotion.reduction.discretization_error import frequency_errors
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.elastic_forms import GradientRule, lame_constants, strain_gram
from calmotion.shot.character import ElasticMaterial
from calmotion.shot.materials.printed import Core, core_of

LENGTH, WIDTH = 0.4, 0.02
MODULUS, DENSITY = 2.0e9, 1200.0


def material(core):
    return ElasticMaterial("/Looks/PLA", MODULUS, 0.3, DENSITY, core=core)


def test_a_core_like_the_skin_is_a_solid_body(helpers):
    points, tets = helpers.box((6, 1, 2), (LENGTH, WIDTH, WIDTH))
    solid, same = (assemble(np.asarray(points), tets, material(core)) for core in (None, Core(1e-3, 1.0, 1.0)))
    assert abs(same.stiffness - solid.stiffness).max() < 1e-9 * abs(solid.stiffness).max()
    assert abs(same.mass - solid.mass).max() < 1e-9 * abs(solid.mass).max()


def test_rules_are_positive_and_exact_for_linear_strains(helpers):
    points, tets = helpers.box((6, 1, 2), (LENGTH, WIDTH, WIDTH))
    filling = assemble(np.asarray(points), tets, material(Core(1e-3, 0.2, 0.1))).mesh.filling
    assert filling.weights.min() > 0.0
    assert filling.points.sum(axis=2) == pytest.approx(1.0)
    g = 0.1 + 0.9 * filling.skin.shares
    direct = np.einsum("ep,pa,pb->eab", g, filling.skin.places, filling.skin.places) / g.shape[1]
    rule = np.einsum("eq,eqa,eqb->eab", filling.weights, filling.points, filling.points)
    assert np.abs(rule - direct).max() < 2e-3  # parts have an extent of their own
    assert filling.weights.sum(axis=1) == pytest.approx(g.mean(axis=1), rel=1e-9)


@pytest.mark.parametrize("counts", [(16, 1, 1), (32, 2, 2)])
def test_a_slender_print_bends_as_a_beam_of_skin_and_core_even_with_one_element_across(helpers, counts):
    """Euler and Bernoulli's beam with the sum of both stiffnesses; shear is 0.8% of a solid bar's deflection here."""
    points, tets = helpers.box(counts, (LENGTH, WIDTH, WIDTH))
    core = core_of(0.2, 0.9e-3)
    model = assemble(np.asarray(points), tets, material(core))
    held = np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9)
    found = frequency_errors(model, material(core), 2, held)[0]
    inner = WIDTH - 2.0 * core.skin
    stiffness = MODULUS * (WIDTH**4 - inner**4 + core.stiffness * inner**4) / 12.0
    line = DENSITY * (WIDTH**2 - inner**2 + core.infill * inner**2)
    beam = 3.516 / (2.0 * np.pi) * np.sqrt(stiffness / line) / LENGTH**2
    assert found == pytest.approx(beam, rel=0.02)
    solid = 3.516 / (2.0 * np.pi) * np.sqrt(MODULUS * WIDTH**2 / 12.0 / DENSITY) / LENGTH**2
    assert abs(found[0] / solid - 1.0) > 0.025  # a solid body of the same geometry is another one


def test_the_mass_of_the_shot_is_kept_and_goes_to_skin_and_core_alike(helpers):
    points, tets = helpers.box((16, 1, 1), (LENGTH, WIDTH, WIDTH))
    core = core_of(0.2, 0.9e-3)
    given = assemble(np.asarray(points), tets, material(core), 0.05)
    free = assemble(np.asarray(points), tets, material(core))
    assert given.mass.sum() == pytest.approx(0.05)
    assert abs(given.mass / given.mass.sum() - free.mass / free.mass.sum()).max() < 1e-12


def test_energies_of_large_deflections_begin_with_the_stiffness(helpers):
    """The Gram matrix of strains and the assembled stiffness are integrated over the same material."""
    points, tets = helpers.box((6, 1, 2), (LENGTH, WIDTH, WIDTH))
    core = core_of(0.3, 1.2e-3)
    model = assemble(np.asarray(points), tets, material(core))
    modes = np.random.default_rng(4).normal(size=(len(model.mesh.nodes), 3, 2))
    gram = strain_gram(GradientRule(model.mesh, 4), modes, *lame_constants(MODULUS, 0.3))
    flat = modes.reshape(-1, 2)
    assert gram[:2, :2] == pytest.approx(flat.T @ (model.stiffness @ flat), rel=1e-9)
    assert np.linalg.eigvalsh(gram).min() > -1e-9 * np.linalg.eigvalsh(gram).max()
