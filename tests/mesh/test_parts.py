"""Which part of an assembly holds a place."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.mass import mass_of_tets
from calmotion.mesh.parts import holders, makeup_of, part_of_places, places_of, skin_share
from calmotion.mesh.tetrahedra import tet_volumes
from calmotion.model.character import ElasticMaterial
from calmotion.model.meshes import Core, Part, core_of
from calmotion.reduction.basis.natural_modes import clamped_modes
from calmotion.reduction.damping import ratio_of_parts
from calmotion.reduction.discretization_error import frequency_errors
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.elastic_forms import LAW_ORDER, GradientRule, lame_constants, strain_gram
from scipy.optimize import brentq


def part(mesh, name):
    return Part(f"/Body/{name}", f"/Looks/{name}", np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int32), 1, 1, 0)


def box(low, high, name):
    return part(trimesh.creation.box(bounds=[low, high]), name)


def test_an_insert_is_inside_the_shell_around_it_whatever_their_order():
    shell, insert = box((0, 0, 0), (1, 1, 1), "shell"), box((0.4, 0.4, 0.4), (0.6, 0.6, 0.6), "insert")
    places = np.array([[0.5, 0.5, 0.5], [0.1, 0.5, 0.5], [0.55, 0.45, 0.5]])
    assert holders(places, (shell, insert)).tolist() == [1, 0, 1]
    assert holders(places, (insert, shell)).tolist() == [0, 1, 0]


def test_between_parts_and_far_from_all_the_nearest_one_counts():
    parts = box((0, 0, 0), (1, 1, 1), "a"), box((1.1, 0, 0), (2, 1, 1), "b")
    places = np.array([[1.02, 0.5, 0.5], [1.08, 0.5, 0.5], [9.0, 0.5, 0.5], [-7.0, 0.0, 0.0]])
    assert holders(places, parts).tolist() == [0, 1, 1, 0]


def test_tetrahedra_across_a_side_are_divided_by_it(helpers):
    parts = box((0, 0, 0), (0.37, 1, 1), "a"), box((0.37, 0, 0), (1, 1, 1), "b")
    points, tets = helpers.box((4, 2, 2), (1.0, 1.0, 1.0))
    points = np.asarray(points)
    held = part_of_places(points, tets, parts, places_of(6))
    volume = tet_volumes(points, tets) @ (held == 0).mean(axis=1)
    assert abs(volume - 0.37) < 0.01
    middle = points[tets][:, :, 0]
    assert (held[middle.max(axis=1) < 0.3] == 0).all() and (held[middle.min(axis=1) > 0.4] == 1).all()


SIZE = np.array([0.2, 0.02, 0.03])


@pytest.mark.parametrize("counts", [(8, 1, 1), (20, 2, 3), (40, 4, 6)])
@pytest.mark.parametrize("skin", [0.9e-3, 2e-3])
def test_the_skin_of_a_box_has_its_volume_on_any_mesh(helpers, counts, skin):
    points, tets = helpers.box(counts, tuple(SIZE))
    share = skin_share(np.asarray(points), tets, Core(skin, 0.2, 0.1))
    found = tet_volumes(points, tets) @ (0.2 + 0.8 * share.shares.mean(axis=1))
    inner = float(np.prod(SIZE - 2.0 * skin))
    assert found == pytest.approx(float(np.prod(SIZE)) - 0.8 * inner, rel=0.004)


def test_places_are_in_the_tetrahedron_and_mean_its_center(helpers):
    points, tets = helpers.box((2, 1, 1), tuple(SIZE))
    places = skin_share(np.asarray(points), tets, Core(1e-3, 0.2, 0.1)).places
    assert places.min() > 0.0 and places.sum(axis=1) == pytest.approx(1.0)
    assert places.mean(axis=0) == pytest.approx(0.25, abs=1e-12)


def test_a_skin_that_is_thicker_than_the_body_is_all_of_it(helpers):
    points, tets = helpers.box((8, 1, 1), tuple(SIZE))
    assert skin_share(np.asarray(points), tets, Core(0.02, 0.2, 0.1)).shares == pytest.approx(1.0)


def test_the_mass_of_a_print_is_less_and_its_moments_are_larger_for_it(helpers):
    points, tets = helpers.box((20, 2, 3), tuple(SIZE))
    points = np.asarray(points)
    solid = mass_of_tets(points, tets, 1000.0)
    makeup = makeup_of(points, tets, ElasticMaterial("/PLA", 2e9, 0.3, 1000.0, core=Core(1e-3, 0.2, 0.1)))
    printed = mass_of_tets(points, tets, 1000.0, makeup=makeup)
    assert 0.2 * solid.mass < printed.mass < 0.6 * solid.mass
    assert printed.center == pytest.approx(solid.center, abs=2e-4)
    assert printed.inertia[0, 0] / printed.mass > 1.1 * solid.inertia[0, 0] / solid.mass
    assert mass_of_tets(points, tets, 1000.0, 0.05, makeup).mass == pytest.approx(0.05)


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
    g, places = filling.makeup.moduli, filling.makeup.places
    direct = np.einsum("ep,pa,pb->eab", g, places, places) / g.shape[1]
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
    gram = strain_gram(GradientRule(model.mesh, LAW_ORDER), modes, *lame_constants(MODULUS, 0.3))
    flat = modes.reshape(-1, 2)
    assert gram[:2, :2] == pytest.approx(flat.T @ (model.stiffness @ flat), rel=1e-9)
    assert np.linalg.eigvalsh(gram).min() > -1e-9 * np.linalg.eigvalsh(gram).max()


def part_filling(points, faces, name, modulus, density, damping=0.01):
    return Part(f"/Bar/{name}", f"/Looks/{name}", points, faces, modulus, density, damping)


def cut(low, high, name, modulus, density, damping=0.01):
    """A part of the bar from one fraction of its extent to another."""
    made = trimesh.creation.box(bounds=np.array([low, high]) * [LENGTH, WIDTH, WIDTH])
    return part_filling(np.asarray(made.vertices), np.asarray(made.faces, np.int32), name, modulus, density, damping)


def first_frequency(points, tets, parts):
    metal = ElasticMaterial("/Looks/Base", MODULUS, 0.3, DENSITY, parts=parts)
    model = assemble(np.asarray(points), tets, metal)
    held = np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9)
    return frequency_errors(model, metal, 1, held)[0][0], model


@pytest.mark.parametrize("across", [1, 2, 3])
def test_a_bar_of_two_layers_bends_about_the_axis_of_both_whatever_the_elements(helpers, across):
    """Euler and Bernoulli with the section transformed to one material (Timoshenko 1925, bimetal strips)."""
    layers = (cut((0, 0, 0), (1, 1, 0.5), "Steel", 10.0, 3.0), cut((0, 0, 0.5), (1, 1, 1), "Nylon", 1.0, 1.0))
    found, model = first_frequency(*helpers.box((40, across, across), (LENGTH, WIDTH, WIDTH)), layers)
    h, moduli, heights = WIDTH / 2, np.array([10.0, 1.0]), np.array([0.25, 0.75]) * WIDTH
    axis = moduli @ heights / moduli.sum()
    soft_way = MODULUS * WIDTH * float(moduli @ (h**3 / 12.0 + h * (heights - axis) ** 2))
    other_way = MODULUS * h * WIDTH**3 / 12.0 * moduli.sum()
    line = DENSITY * WIDTH * h * 4.0
    beam = 3.516 / (2.0 * np.pi) * np.sqrt(min(soft_way, other_way) / line) / LENGTH**2
    assert found == pytest.approx(beam, rel=0.02)
    assert model.mass.sum() == pytest.approx(line * LENGTH, rel=0.01)


def test_a_bar_of_two_lengths_vibrates_as_a_stepped_beam(helpers):
    """The root steel, the end nylon; the elements do not end where the steel does."""
    step, stiff, heavy = 0.43, 20.0, 6.0
    parts = (cut((0, 0, 0), (step, 1, 1), "Steel", stiff, heavy), cut((step, 0, 0), (1, 1, 1), "Nylon", 1.0, 1.0))
    found, model = first_frequency(*helpers.box((40, 2, 2), (LENGTH, WIDTH, WIDTH)), parts)
    assert found == pytest.approx(stepped_beam(step * LENGTH, stiff, heavy), rel=0.01)
    mass = DENSITY * WIDTH**2 * LENGTH * (heavy * step + 1.0 - step)
    assert model.mass.sum() == pytest.approx(mass, rel=5e-3)


def stepped_beam(step, stiff, heavy):
    """First frequency [Hz] of a clamped beam of two lengths: by Euler and Bernoulli, continuous at the step."""
    bending, line = MODULUS * WIDTH**4 / 12.0, DENSITY * WIDTH**2

    def rows(x, k):
        """Displacement, slope, curvature and its slope of cos, sin, cosh, sinh."""
        c, s, ch, sh = np.cos(k * x), np.sin(k * x), np.cosh(k * x), np.sinh(k * x)
        return np.array([
            [c, s, ch, sh],
            [-k * s, k * c, k * sh, k * ch],
            [-(k**2) * c, -(k**2) * s, k**2 * ch, k**2 * sh],
            [k**3 * s, -(k**3) * c, k**3 * sh, k**3 * ch],
        ])  # fmt: skip

    def determinant(omega):
        k1, k2 = ((omega**2 * heavy * line / (stiff * bending)) ** 0.25, (omega**2 * line / bending) ** 0.25)
        scale = np.array([1.0, 1.0, stiff, stiff])[:, None]
        clamped = np.hstack([rows(0.0, k1)[:2], np.zeros((2, 4))])
        joined = np.hstack([scale * rows(step, k1), -rows(step, k2)])
        free = np.hstack([np.zeros((2, 4)), rows(LENGTH, k2)[2:]])
        return np.linalg.det(np.vstack([clamped, joined, free]))

    grid = np.linspace(1.0, 2.0 * np.pi * 200.0, 4000)
    values = np.array([determinant(omega) for omega in grid])
    first = int(np.flatnonzero(values[1:] * values[:-1] < 0.0)[0])
    return brentq(determinant, grid[first], grid[first + 1]) / (2.0 * np.pi)


def test_damping_is_weighted_by_the_strain_energy_of_the_parts(helpers):
    """A stiff damped root holds nearly no energy; two equal halves of one section, half each."""

    def ratio(*parts):
        _, model = first_frequency(*helpers.box((20, 2, 2), (LENGTH, WIDTH, WIDTH)), parts)
        metal = ElasticMaterial("/Looks/Base", MODULUS, 0.3, DENSITY, parts=parts)
        held = np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9)
        return ratio_of_parts(model.mesh, metal, clamped_modes(model, 2, held)[1])

    side = ratio(cut((0, 0, 0), (1, 1, 0.5), "A", 1.0, 1.0, 0.02), cut((0, 0, 0.5), (1, 1, 1), "B", 1.0, 1.0, 0.06))
    assert side == pytest.approx(0.04, rel=1e-3)
    root = ratio(cut((0, 0, 0), (0.1, 1, 1), "A", 1e4, 1.0, 0.5), cut((0.1, 0, 0), (1, 1, 1), "B", 1.0, 1.0, 0.01))
    assert root == pytest.approx(0.01, rel=0.1)
    assert (
        ratio_of_parts(
            assemble(*helpers.box((2, 1, 1), (1.0, 1.0, 1.0)), material(None)).mesh, material(None), np.zeros((0, 3, 1))
        )
        is None
    )
