"""The change of stiffness and frequencies by missing volume, against meshes that have it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.grids.missing_volume import missing_volume
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.surfaces.nearby_triangles import NearbyTriangles
from calmotion.mesh.tetrahedra import boundary_triangles, measure_quality
from calmotion.model import Body, FEMesh, FlexibleSettings
from calmotion.reduction.full_order.mesh_estimates import frequency_estimate, load_estimate
from calmotion.reduction.full_order.mesh_extrapolation import Estimate, by_shape
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.mesh_refinement import Effort, refined_for_frequencies, refined_for_loads, with_own_stiffness
from calmotion.reduction.reduce import linear_modes

SIZE, MORE = (0.3, 0.04, 0.03), (0.0, 0.0, 4e-4)  # too thin by 1.3%


def mesh_of(helpers, size, missing_of=None):
    points, tets = helpers.box((12, 2, 2), size)
    mesh = FEMesh(0, np.asarray(points) - [0.0, 0.5 * size[1], 0.5 * size[2]], tets, measure_quality(points, tets))
    if missing_of is None:
        return mesh
    corners, bricks = helpers.box((1, 1, 1), missing_of)
    corners = np.asarray(corners) - [0.0, 0.5 * missing_of[1], 0.5 * missing_of[2]]
    surface = NearbyTriangles(corners, boundary_triangles(bricks), 2e-3)
    found = missing_volume(mesh.points, mesh.tets, surface)
    return replace(mesh, missing=found)


@pytest.fixture(scope="module")
def thick(helpers):
    return mesh_of(helpers, np.add(SIZE, MORE))


@pytest.fixture(scope="module")
def thin(helpers):
    return mesh_of(helpers, SIZE, np.add(SIZE, MORE))


@pytest.fixture(scope="module")
def beam(helpers, plastic):
    return Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))


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


def test_frequencies_change_as_those_of_a_thicker_beam(helpers, beam, thin, thick):
    carrier = helpers.frame(0, 0, 0)
    own, exact = (frequency_estimate(mesh, beam, carrier) for mesh in (thin, thick))
    change = exact.squares / own.squares - 1.0  # twice the relative thickness where it bends the thin way
    assert change[0] == pytest.approx(2.0 * MORE[2] / SIZE[2], rel=0.05)
    assert own.shape_squares == pytest.approx(change, abs=0.05 * change[0])
    # all of it is missing, and adds stiffness: nothing cancels but by the mass
    assert (own.shape_whole > own.shape_squares).all()


def test_interfaces_are_stiffer_as_those_of_a_thicker_beam(beam, thin, thick, frames, loads):
    own, exact = (
        load_estimate(linear_modes(mesh, beam, frames, 1, loads, 1e-4), beam, mesh.missing) for mesh in (thin, thick)
    )
    more = np.diag(own.shape_stiffness) / np.diag(own.interfaces)
    told = np.diag(exact.interfaces) / np.diag(own.interfaces) - 1.0
    assert more == pytest.approx(told, abs=0.07 * told.max()) and told.max() > 0.03


def test_a_mesh_that_is_too_thin_has_the_stiffness_of_its_surface(helpers, beam, thin, thick, frames, loads):
    carrier = helpers.frame(0, 0, 0)
    by_itself, told = (
        refined_for_frequencies(mesh, beam, carrier, Effort(np.inf, 0)) for mesh in (replace(thin, missing=None), thin)
    )
    assert by_itself.quality.shape_error == 0.0 < told.quality.shape_error < 0.01
    assert told.quality.frequency_error == pytest.approx(by_itself.quality.frequency_error)
    assert told.quality.error == told.quality.frequency_error + told.quality.shape_error
    first = [
        m.quality.stiffness_factor * frequency_estimate(m, beam, carrier).squares[:2] for m in (told, thick, by_itself)
    ]
    # one factor for both ways to bend, which differ
    off, before = (np.abs(squares / first[1] - 1.0).max() for squares in (first[0], first[2]))
    assert off < 2.0 * told.quality.shape_error and off < 0.7 * before
    finer = refined_for_loads(told, beam, frames, 1, loads, 1e-4, 0.0, 2_000)
    exact = refined_for_loads(thick, beam, frames, 1, loads, 1e-4, 0.0, 2_000)
    assert finer.missing is thin.missing or np.array_equal(finer.missing.volumes, thin.missing.volumes)
    stiffness = []
    for mesh in (finer, exact):
        linear = linear_modes(with_own_stiffness(mesh), beam, frames, 1, loads, 1e-4)
        stiffness.append(np.diag(load_estimate(linear, beam).interfaces @ mesh.quality.interface_factors))
    assert stiffness[0] == pytest.approx(stiffness[1], rel=3e-3)


def test_what_may_be_wrong_goes_with_all_that_the_mesh_leaves_in_places():
    some = Estimate(0.1, np.ones(2), np.array([0.75, 0.25]), np.zeros(0), 10)
    assert by_shape(some) == (0.0, 0.0)
    known = replace(some, shape_squares=np.array([0.01, -0.03]), shape_whole=np.array([0.05, 0.1]))
    mean, error = by_shape(known)
    assert mean == pytest.approx(0.0) and error == pytest.approx(0.03 + 0.02)
