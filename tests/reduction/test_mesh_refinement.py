"""Refined meshes: their error against far finer meshes, and the stiffness that a coarse one takes from a fine one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calmotion.linear_algebra.multifrontal import FactorsTooLarge
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.tetrahedra import measure_quality, tet_volumes
from calmotion.model import Body, FEMesh, FlexibleSettings
from calmotion.reduction import mesh_refinement
from calmotion.reduction.basis.natural_modes import frequencies
from calmotion.reduction.cache import recomputed
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.full_order.mesh_estimates import frequency_estimate, load_estimate
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.mesh_refinement import Effort, refined_for_frequencies, refined_for_loads
from calmotion.reduction.reduce import full_body, linear_modes, reduce_body
from scipy.linalg import eigh

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


def first(mesh, beam, frames, loads):
    return linear_modes(mesh, beam, frames, 1, loads, 1e-4).basis.omega_squared[:2]


def sag(mesh, beam, frames, loads):
    """How far the end gives way to unit forces across [m/N], shape [2]."""
    full = full_body(mesh, beam, frames, 1)
    stiffness = load_estimate(linear_modes(mesh, beam, frames, 1, loads, 1e-4, full), beam).interfaces
    return np.diag(np.linalg.inv(stiffness))[1:3]


@pytest.fixture(scope="module")
def finest(helpers, beam, frames, loads):
    """Of elements without size: 600, 4,000 and 28,000 nodes have errors each of which is 0.3 of the last."""
    coarse, fine = (first(mesh_of(helpers, counts), beam, frames, loads) for counts in ((12, 2, 2), (24, 4, 4)))
    return fine - (coarse - fine) / 2.2


def test_the_first_frequencies_are_refined_to_the_wanted_error(helpers, beam, frames):
    coarse, carrier = mesh_of(helpers, (4, 1, 1)), frames[1].frame
    fine = refined_for_frequencies(coarse, beam, carrier, Effort(0.02, 15_000))
    assert len(fine.tets) > len(coarse.tets) and fine.quality.frequency_error <= 0.01
    assert fine.quality.volume == pytest.approx(tet_volumes(fine.points, fine.tets).sum(), rel=1e-9)
    one, half, whole = (
        frequency_estimate(mesh, beam, carrier).squares[0]
        for mesh in (fine, mesh_of(helpers, (12, 2, 2)), mesh_of(helpers, (24, 4, 4)))
    )
    exact = whole - (half - whole) / 2.2
    off, left = (abs(np.sqrt(square / exact) - 1.0) for square in (one, fine.quality.stiffness_factor * one))
    assert off < 0.02 and left < 0.5 * off and left < fine.quality.frequency_error
    kept = refined_for_frequencies(coarse, beam, carrier, Effort(0.02, 0))  # no nodes are allowed
    assert np.array_equal(kept.tets, coarse.tets) and kept.quality.stiffness_factor == 1.0


def test_refinement_ends_where_the_memory_does(helpers, beam, monkeypatch):
    def estimate(mesh, *arguments, **named):
        if len(mesh.tets) > len(coarse.tets):
            raise FactorsTooLarge("there is not enough memory")
        return frequency_estimate(mesh, *arguments, **named)

    coarse = mesh_of(helpers, (8, 1, 1))
    monkeypatch.setattr(mesh_refinement, "frequency_estimate", estimate)
    with recomputed():
        kept = refined_for_frequencies(coarse, beam, helpers.frame(0, 0, 0), Effort(0.02, 15_000))
    assert len(kept.tets) == len(coarse.tets) and kept.quality.frequency_error > 0.02


def test_more_nodes_are_spent_on_meshes_with_a_poor_estimate():
    effort = Effort(0.02, 12_000, 0.08, 20_000)
    assert effort.ends(0.01, 500) and not effort.ends(0.03, 500)
    assert effort.ends(0.07, 8_000) and not effort.ends(0.09, 8_000)
    assert effort.allows(0.1, 8_000, 19_000) and not effort.allows(0.1, 8_000, 21_000)
    assert effort.allows(0.1, 7_000, 21_000)  # few as they are, whatever one bisection makes of them
    assert not Effort(0.02, 12_000).allows(0.1, 8_000, 8_100)


def test_still_more_nodes_are_spent_on_meshes_whose_frequencies_tell_nothing():
    effort = Effort(0.02, 12_000, 0.08, 20_000, bad=0.2, bad_nodes=50_000)
    assert not effort.allows(0.19, 15_000, 30_000) and effort.allows(0.21, 15_000, 49_000)
    assert not effort.allows(0.21, 15_000, 51_000)
    assert effort.allows(0.21, 30_000, 45_000)
    assert effort.ends(0.19, 30_000) and not effort.ends(0.21, 30_000)  # until the error is no longer bad
    assert not replace(effort, bad=0.05).ends(0.07, 8_000)  # what the volume leaves of it may be less than poor


def test_what_the_volume_is_off_by_counts_for_a_bad_error(helpers, beam, frames):
    coarse, carrier = mesh_of(helpers, (8, 2, 2)), frames[1].frame
    error = frequency_estimate(coarse, beam, carrier).error
    effort = Effort(0.0, 0, np.inf, 430, bad=1.4 * error, bad_nodes=1_500)
    nodes = []
    for volume_error in (0.0, 0.3 * error):
        quality = replace(coarse.quality, volume_error=volume_error)
        fine = refined_for_frequencies(replace(coarse, quality=quality), beam, carrier, effort)
        nodes.append(frequency_estimate(fine, beam, carrier).nodes)
    assert nodes[0] <= 430 < nodes[1] <= 1_500


@pytest.mark.parametrize(("falls", "goes_on"), [(0.95, False), (0.8, True)])
def test_nodes_are_no_longer_spent_where_the_error_hardly_falls(helpers, beam, frames, monkeypatch, falls, goes_on):
    """As where parts hang on a hinge, which ever finer elements hold less and less."""
    monkeypatch.setattr(mesh_refinement, "extrapolation", lambda estimates, _: (0.0, falls ** len(estimates)))
    own = replace(beam, path=f"/Arm/falls{falls}")  # no other test takes it from the cache
    effort = Effort(0.0, 0, 0.0, 430, bad=0.01, bad_nodes=1_500)
    with recomputed():
        fine = refined_for_frequencies(mesh_of(helpers, (6, 1, 1)), own, frames[1].frame, effort)
    nodes = frequency_estimate(fine, beam, frames[1].frame).nodes
    assert (900 if goes_on else 430) < nodes < (1_500 if goes_on else 900)


def test_a_link_keeps_few_nodes_where_one_factor_is_that_of_finer_meshes(helpers, beam, frames):
    coarse, carrier = mesh_of(helpers, (6, 1, 1)), frames[1].frame
    effort = Effort(0.0, 0, 0.0, 5_000)  # as fine as it may be
    finest, kept = (refined_for_frequencies(coarse, beam, carrier, replace(effort, kept_nodes=n)) for n in (1e9, 1_000))
    estimates = [frequency_estimate(mesh, beam, carrier) for mesh in (finest, kept)]
    assert estimates[1].nodes <= 1_000 and 2_500 < estimates[0].nodes <= 5_000
    assert kept.quality.element_error > 3.0 * finest.quality.element_error
    fine, own = (mesh.quality.stiffness_factor * e.squares for mesh, e in zip((finest, kept), estimates, strict=True))
    off = np.abs(np.sqrt(own / fine) - 1.0)
    assert off.max() < 0.005 and off[0] < 1e-3 < np.abs(estimates[1].squares / fine - 1.0).max()
    extra = kept.quality.frequency_error - finest.quality.frequency_error
    assert 0.5 * off.max() < extra < 0.005


def test_modes_that_one_factor_does_not_serve_keep_finer_elements(helpers, beam, frames, monkeypatch):
    monkeypatch.setattr(mesh_refinement, "_APART", 1e-4)
    effort = Effort(0.0, 0, 0.0, 5_000, 500)
    own = replace(beam, path="/Arm/own")  # no other test takes it from the cache
    with recomputed():
        kept = refined_for_frequencies(mesh_of(helpers, (6, 1, 1)), own, frames[1].frame, effort)
    assert frequency_estimate(kept, beam, frames[1].frame).nodes > 1_000


def test_a_bisection_that_would_be_too_many_nodes_is_smaller(helpers, beam, frames):
    coarse, carrier = mesh_of(helpers, (6, 1, 1)), frames[1].frame
    nodes = []
    for most in range(600, 1_800, 150):
        fine = refined_for_frequencies(coarse, beam, carrier, Effort(0.0, 0, 0.0, most))
        nodes.append(frequency_estimate(fine, beam, carrier).nodes)
        assert 0.6 * most < nodes[-1] <= most
    assert len(set(nodes)) > 3


def test_local_refinement_needs_fewer_nodes_than_a_uniform_one(helpers, beam, frames):
    coarse, uniform = mesh_of(helpers, (8, 2, 2)), mesh_of(helpers, (16, 4, 4))
    target = frequency_estimate(uniform, beam, frames[1].frame)
    fine = refined_for_frequencies(coarse, beam, frames[1].frame, Effort(target.error, 15_000))
    assert frequency_estimate(fine, beam, frames[1].frame).nodes < 0.7 * target.nodes


def test_a_coarse_mesh_takes_the_stiffness_of_a_finer_one(helpers, beam, frames, loads, finest):
    coarse = mesh_of(helpers, (8, 2, 2))
    as_fine = refined_for_loads(coarse, beam, frames, 1, loads, 1e-4, 1e-3, 15_000)
    assert np.array_equal(as_fine.tets, coarse.tets) and as_fine.quality.stiffness_factor < 1.0
    many = replace(beam, flexible=replace(beam.flexible, elasticity="linear", mode_count=12))
    reduced = [reduce_body(mesh, many, frames, [], 1, loads) for mesh in (coarse, as_fine)]
    before, after = (np.abs(body.stiffness[:2] / finest - 1.0).max() for body in reduced)
    softest = eigh(reduced[1].interfaces.softest, reduced[1].interfaces.own, eigvals_only=True)
    assert before > 0.02 and after < 0.15 * before and after < 1.0 - softest.min()
    # the load is at the end: how far that gives way is what the estimate is about, not the modes of the beam alone
    coarser, finer = (sag(mesh_of(helpers, counts), beam, frames, loads) for counts in ((12, 2, 2), (24, 4, 4)))
    off = np.abs(np.diag(np.linalg.inv(reduced[1].interfaces.own))[1:3] / (finer - (coarser - finer) / 2.2) - 1.0)
    assert off.max() < reduced[1].mesh_error and softest.max() < 1.0 and reduced[1].element_error > 0.01
    assert reduced[1].mesh_error == 2.0 * as_fine.quality.frequency_error


@pytest.mark.parametrize("law", ["linear", "stvk", "neohookean"])
def test_interfaces_have_the_static_stiffness_of_the_finer_mesh_in_every_direction(helpers, beam, frames, loads, law):
    own = replace(beam, flexible=replace(beam.flexible, elasticity=law, mode_count=6 if law != "linear" else 24))
    meshes = [mesh_of(helpers, counts) for counts in ((4, 1, 1), (8, 2, 2))]
    stiffness = []
    for mesh in meshes:
        full = full_body(mesh, own, frames, 1)
        stiffness.append(full.support.fixed(full.model).patch_stiffness())
    factors = np.linalg.solve(*stiffness)
    quality = replace(meshes[0].quality, stiffness_factor=0.9, interface_factors=factors)
    corrected, coarse = (
        reduce_body(mesh, own, frames, [], 1, loads) for mesh in (replace(meshes[0], quality=quality), meshes[0])
    )
    own, finer = (np.diag(np.linalg.inv(K))[1:] for K in stiffness)
    assert np.abs(own / finer - 1.0).max() > 0.03  # bending and twist
    # as much as the coordinates see of the compliance of the mesh
    assert _compliance(corrected)[1:] / finer == pytest.approx(_compliance(coarse)[1:] / own, rel=0.02)
    assert corrected.invariants.M == pytest.approx(np.eye(len(corrected.stiffness)), abs=1e-9)


def _compliance(body):
    """Static compliance of the tip in its six directions."""
    tip = np.vstack([body.markers[0].Phi, body.markers[0].Psi])
    return ((tip / body.stiffness) * tip).sum(axis=1)


def test_finer_elements_are_kept_where_their_own_error_matters(helpers, beam, frames, loads):
    coarse = mesh_of(helpers, (4, 1, 1))
    kept = [
        refined_for_loads(coarse, beam, frames, 1, loads, 1e-4, 5e-3, 15_000, elements=error)
        for error in (np.inf, 0.05, 0.0)
    ]
    assert kept[0].quality.element_error > 0.05 >= kept[1].quality.element_error > kept[2].quality.element_error
    assert len(coarse.tets) == len(kept[0].tets) < len(kept[1].tets) < len(kept[2].tets)
    first_frequencies = [first(mesh, beam, frames, loads) for mesh in kept[1:]]
    assert first_frequencies[0] == pytest.approx(first_frequencies[1], rel=0.01), "with the same statics"


@pytest.mark.parametrize("known_error, kept", [(0.001, True), (0.5, False), (None, False)])
def test_a_mesh_beyond_the_limit_keeps_what_its_frequencies_told(
    helpers, beam, frames, loads, known_error, kept, monkeypatch
):
    monkeypatch.setattr(mesh_refinement, "_MOST", 1_000)
    mesh = mesh_of(helpers, (24, 2, 2))
    mesh = replace(mesh, quality=replace(mesh.quality, stiffness_factor=0.97, frequency_error=known_error))
    few = Effort(1e-4, 1_000)  # no finer mesh is allowed
    found = refined_for_loads(mesh, beam, frames, 1, loads, 1e-4, few.wanted, few.max_nodes)
    assert (found.quality.stiffness_factor == 0.97) == kept
    finer = refined_for_loads(mesh, beam, frames, 1, loads, 1e-4, few.wanted, 4_000)
    assert finer.quality.interface_factors is not None and finer.quality.stiffness_factor != 0.97


@pytest.fixture
def estimated_nodes(monkeypatch):
    """Nodes of the meshes that are estimated for loads."""
    nodes, estimated = [], mesh_refinement.load_estimate

    def noted(*arguments):
        found = estimated(*arguments)
        nodes.append(found.nodes)
        return found

    monkeypatch.setattr(mesh_refinement, "load_estimate", noted)
    with recomputed():
        yield nodes


def test_a_mesh_near_the_limit_is_followed_by_finer_ones(helpers, beam, frames, loads, estimated_nodes):
    near, nodes = replace(beam, path="/Arm/near"), estimated_nodes
    refined_for_loads(mesh_of(helpers, (12, 2, 2)), near, frames, 1, loads, 1e-4, 1e-6, 700)
    assert nodes[0] > 0.6 * 700 and len(nodes) > 2 and nodes[-2] <= 0.6 * 3.3 * nodes[0] < nodes[-1]


@pytest.mark.parametrize("wanted, further", [(1e-6, True), (1e-2, False)])
def test_a_mesh_that_is_off_by_far_more_than_wanted_is_followed_by_more(
    helpers, beam, frames, loads, estimated_nodes, wanted, further
):
    mesh, nodes = mesh_of(helpers, (6, 1, 1)), estimated_nodes
    refined_for_loads(mesh, beam, frames, 1, loads, 1e-4, wanted, 1_000)
    few = list(nodes)
    del nodes[:]
    refined_for_loads(mesh, beam, frames, 1, loads, 1e-4, wanted, 1_000, poor_nodes=8_000)
    assert nodes[: len(few)] == few and nodes[-1] <= 8_000 and (len(nodes) > len(few)) == further


def test_a_link_that_hardly_bends_keeps_its_stiffness(helpers, beam, frames, loads):
    """It has no modes by which the stiffness of two meshes could be compared."""
    idle = replace(loads, force=1e-9 * loads.force)
    coarse = mesh_of(helpers, (12, 2, 2))
    assert not len(linear_modes(coarse, beam, frames, 1, idle, 1e-2).basis.omega_squared)
    found = refined_for_loads(coarse, beam, frames, 1, idle, 1e-2, 0.0, 3000)
    assert found.quality.stiffness_factor == pytest.approx(1.0, abs=0.05)
    bent = reduce_body(found, beam, frames, [], 1, loads, 1e-4)
    known = reduce_body(coarse, beam, frames, [], 1, loads, 1e-4)
    assert bent.stiffness[:2] == pytest.approx(known.stiffness[:2], rel=0.05)


def test_finer_elements_are_taken_instead_for_a_reference(helpers, beam, frames, loads, finest):
    coarse = mesh_of(helpers, (4, 1, 1))
    marked = replace(coarse, quality=replace(coarse.quality, stiffness_factor=0.9))  # of an earlier refinement
    fine = refined_for_loads(marked, beam, frames, 1, loads, 1e-4, 5e-3, 15_000, by_factor=False)
    assert len(fine.tets) > 2 * len(coarse.tets) and 0.97 < fine.quality.stiffness_factor < 1.0
    off = np.abs(first(fine, beam, frames, loads) / finest - 1.0).max()
    assert off < max(2.0 * fine.quality.frequency_error, 5e-3)


def test_the_volume_is_part_of_the_error(helpers, beam, frames):
    mesh = mesh_of(helpers, (8, 2, 2))
    smaller = replace(mesh, quality=replace(mesh.quality, volume_error=0.01))
    judged = [refined_for_frequencies(m, beam, frames[1].frame, Effort(np.inf, 0)) for m in (mesh, smaller)]
    assert judged[1].quality.frequency_error - judged[0].quality.frequency_error == pytest.approx(0.01)


def test_frequencies_of_the_estimate_are_those_of_the_model(helpers, beam, plastic):
    mesh = mesh_of(helpers, (8, 2, 2))
    model = assemble(mesh.points, mesh.tets, plastic)
    squares = frequency_estimate(mesh, beam, None).squares
    assert np.sqrt(squares) / (2.0 * np.pi) == pytest.approx(frequencies(model, 9)[6:], rel=1e-6)
