"""One refinement of a mesh: its error against far finer meshes, and the stiffness that a coarse one takes from it."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.linear_algebra.multifrontal import FactorsTooLarge
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.quadratic import quadratic_nodes
from calmotion.mesh.tetrahedra import measure_quality, tet_volumes
from calmotion.model import Body, FEMesh, FlexibleSettings
from calmotion.reduction import mesh_refinement
from calmotion.reduction.basis.natural_modes import clamped_modes
from calmotion.reduction.cache import recomputed
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.mesh_refinement import MeshController, bisected_to, response, root_at
from calmotion.reduction.reduce import full_body, reduce_body

SIZE = (0.3, 0.04, 0.04)


def mesh_of(helpers, counts):
    points, tets = helpers.box(counts, SIZE)
    points = np.asarray(points) - [0.0, 0.02, 0.02]
    return FEMesh(0, points, tets, measure_quality(points, tets))


@pytest.fixture(scope="module")
def frames(helpers):
    return [
        AttachmentFrame("/Arm/tip", helpers.frame(0.3, 0.0, 0.0), "interface"),
        AttachmentFrame("/Arm/root", helpers.frame(0.0, 0.0, 0.0), "interface"),
    ]


@pytest.fixture(scope="module")
def loads():
    none, force = np.zeros(3), np.array([[0.0, 20.0, 30.0], [0.0, 0.0, 0.0]])
    return LoadEnvelope(none, none, none, force, np.zeros((2, 3)))


@pytest.fixture(scope="module")
def beam(helpers, plastic):
    return Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))


def compliances(mesh, beam, frames, loads=None):
    return response(mesh, beam, frames, 1, loads, 3).compliances


@pytest.fixture(scope="module")
def exact(helpers, beam, frames, loads):
    """Of elements without size, with and without the loads of a shot: each of two finer meshes has 0.3 of the error."""

    def limit(loads):
        coarse, fine = (compliances(mesh_of(helpers, n), beam, frames, loads) for n in ((12, 2, 2), (24, 4, 4)))
        return fine + (fine - coarse) / 2.2

    return {loaded: limit(loads if loaded else None) for loaded in (False, True)}


@pytest.mark.parametrize("counts", [(8, 1, 1), (8, 2, 2), (12, 2, 2)])
@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("keeps", ["", "finer"])
def test_compliances_are_within_the_error_that_is_claimed(helpers, beam, frames, loads, exact, counts, loaded, keeps):
    coarse, own = mesh_of(helpers, counts), loads if loaded else None
    found = MeshController(0.02, 15_000, keeps).refined(coarse, beam, frames, 1, own)
    assert found.quality.volume == pytest.approx(tet_volumes(found.points, found.tets).sum(), rel=1e-9)
    before = np.abs(compliances(coarse, beam, frames, own) / exact[loaded] - 1.0)
    after = compliances(found, beam, frames, own) / exact[loaded] - 1.0
    # across the beam: a twist of one element across it is not what recovered strains see
    seen = [0, 1, 3] if loaded else [0, 1]
    assert np.abs(after[seen]).max() < 2.0 * found.quality.frequency_error
    assert np.abs(after[:2]).max() < 0.5 * before[:2].max()
    if keeps:
        assert len(found.tets) > 2 * len(coarse.tets)


def test_the_finer_mesh_has_as_many_nodes_as_the_wanted_error_asks_for(helpers, beam, frames):
    coarse = mesh_of(helpers, (8, 2, 2))
    made = [MeshController(wanted, most, "finer").refined(coarse, beam, frames, 1)
            for wanted, most in ((0.1, 15_000), (0.002, 15_000), (0.002, 1_500))]  # fmt: skip
    nodes = [quadratic_nodes(mesh.points, mesh.tets) for mesh in made]
    assert nodes[0] < nodes[2] < nodes[1] and nodes[2] < 2.0 * 1_500
    errors = [mesh.quality.frequency_error for mesh in made]
    assert errors[0] > errors[2] > errors[1]


@pytest.mark.parametrize("reason", ["nodes", "memory"])
def test_a_mesh_that_cannot_be_finer_is_kept_with_a_larger_error(helpers, beam, frames, monkeypatch, reason):
    coarse = mesh_of(helpers, (8, 1, 1))
    known = MeshController(0.02, 15_000).refined(coarse, beam, frames, 1)

    def too_large(mesh, *arguments, **named):
        if len(mesh.tets) > len(coarse.tets):
            raise FactorsTooLarge("there is not enough memory")
        return response(mesh, *arguments, **named)

    monkeypatch.setattr(mesh_refinement, "response", too_large)
    with recomputed():
        kept = MeshController(0.02, 10 if reason == "nodes" else 15_000).refined(coarse, beam, frames, 1)
    assert np.array_equal(kept.tets, coarse.tets) and kept.quality.stiffness_factor == 1.0
    assert kept.quality.frequency_error > known.quality.frequency_error


def test_given_elements_stay_as_they_are_with_their_own_error(helpers, beam, frames, exact):
    coarse = mesh_of(helpers, (8, 2, 2))
    kept = MeshController(0.02, 15_000, "given").refined(coarse, beam, frames, 1)
    off = np.abs(compliances(coarse, beam, frames) / exact[False] - 1.0)[:2].max()
    assert np.array_equal(kept.tets, coarse.tets) and kept.quality.stiffness_factor == 1.0
    assert off < 2.0 * kept.quality.frequency_error < 4.0 * off


def test_a_reduced_body_has_the_stiffness_of_ever_finer_meshes(helpers, beam, frames, loads, exact):
    coarse = mesh_of(helpers, (8, 2, 2))
    told = MeshController(0.02, 15_000).refined(coarse, beam, frames, 1, loads)
    many = replace(beam, flexible=replace(beam.flexible, elasticity="linear", mode_count=12))
    before, after = (reduce_body(mesh, many, frames, [], 1, loads) for mesh in (coarse, told))
    off = [np.abs(body.stiffness[:2] * exact[True][:2] - 1.0).max() for body in (before, after)]
    assert off[0] > 0.02 and off[1] < 0.3 * off[0] and off[1] < after.mesh_error
    assert after.mesh_error == told.quality.deflection_error <= 2.0 * told.quality.frequency_error
    assert after.element_error == pytest.approx(1.0 / told.quality.stiffness_factor - 1.0) and before.element_error == 0


def test_what_an_earlier_refinement_told_is_found_anew(helpers, beam, frames):
    coarse, controller = mesh_of(helpers, (8, 2, 2)), MeshController(0.02, 15_000)
    marked = replace(coarse, quality=replace(coarse.quality, stiffness_factor=0.9))
    one, other = (controller.refined(mesh, beam, frames, 1).quality.stiffness_factor for mesh in (coarse, marked))
    assert one == other != 0.9


def test_the_volume_is_part_of_the_error(helpers, beam, frames):
    mesh = mesh_of(helpers, (8, 2, 2))
    smaller = replace(mesh, quality=replace(mesh.quality, volume_error=0.01))
    errors = [MeshController(0.02, 15_000).refined(m, beam, frames, 1).quality.frequency_error for m in (mesh, smaller)]
    assert errors[1] - errors[0] == pytest.approx(0.01)


def test_elements_are_bisected_most_where_the_error_arises(helpers):
    mesh = mesh_of(helpers, (8, 2, 2))
    near = mesh.points[mesh.tets].mean(axis=1)[:, 0] < 0.05
    finer = bisected_to(mesh, np.where(near, 1.0, 1e-3), 2_000, 0.3)
    assert 2_000 <= quadratic_nodes(finer.points, finer.tets) < 3_000
    limited = bisected_to(mesh, np.where(near, 1.0, 1e-3), 2_000, 0.9, 2_000)
    assert 2_000 <= quadratic_nodes(limited.points, limited.tets) < 2_300
    volumes, middle = tet_volumes(finer.points, finer.tets), finer.points[finer.tets].mean(axis=1)[:, 0]
    assert np.median(volumes[middle < 0.05]) < 0.3 * np.median(volumes[middle > 0.1])


def test_frequencies_of_a_body_that_nothing_holds_are_those_of_the_model(helpers, beam, frames, plastic):
    mesh = mesh_of(helpers, (8, 2, 2))
    model = assemble(mesh.points, mesh.tets, plastic)
    found = response(mesh, beam, frames, None, None, 3)
    assert 1.0 / np.sqrt(found.compliances) / (2.0 * np.pi) == pytest.approx(clamped_modes(model, 3)[0], rel=1e-6)


def test_the_root_is_the_joint_at_the_frame_of_the_carrier(helpers, frames):
    assert root_at(frames, helpers.frame(0.0, 0.0, 0.0)) == 1 and root_at(frames, helpers.frame(0.1, 0.0, 0.0)) is None
    assert root_at(frames, None) is None
    points = [replace(frames[0], kind="point"), *frames]
    assert root_at(points, helpers.frame(0.3, 0.0, 0.0)) == 1


def test_a_mesh_whose_interface_is_all_of_it_is_refused(beam, frames):
    points, tets = np.array([[0.0, 0, 0], [0.4, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]), np.array([[0, 1, 2, 3]])
    mesh = FEMesh(0, points, tets, measure_quality(points, tets))
    for refused in (lambda: MeshController(0.02, 15_000).refined(mesh, beam, frames, 1),
                    lambda: full_body(mesh, beam, frames, 1)):  # fmt: skip
        with pytest.raises(ShotError, match="nothing of it can bend") as caught:
            refused()
        assert caught.value.path == "/Arm/link"


def test_the_error_of_a_given_mesh_is_no_less_where_a_finer_one_is_stiffer(helpers, beam, frames, monkeypatch):
    coarse = mesh_of(helpers, (8, 2, 2))

    def stiffer(mesh, *arguments, **named):
        found = response(mesh, *arguments, **named)
        return found if len(mesh.tets) == len(coarse.tets) else replace(found, compliances=0.97 * found.compliances)

    monkeypatch.setattr(mesh_refinement, "response", stiffer)
    with recomputed():
        found = MeshController(0.002, 15_000, "given").refined(coarse, beam, frames, 1)
    assert found.quality.frequency_error > 0.005
