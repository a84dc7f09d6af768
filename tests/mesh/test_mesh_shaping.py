"""Meshes that follow their surface in the mean, with patches that consist of their triangles."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.mesh_shaping import Surface, shaped
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.tetrahedra import boundary_triangles, measure_quality
from calmotion.model import Body, FEMesh, FlexibleSettings

SIZE = (0.2, 0.02, 0.02)


@pytest.fixture
def mesh(helpers):
    """A bar, dented by a twentieth of a millimetre along its edges."""
    points, tets = helpers.box((10, 2, 2), SIZE)
    points = np.asarray(points).copy()
    edge = (np.abs(points[:, 1:] - 0.01) > 0.009).all(axis=1)
    points[edge, 1:] += 5e-5 * np.sign(0.01 - points[edge, 1:])
    return FEMesh(0, points, tets, replace(measure_quality(points, tets), source="surface", frequency_error=0.01))


def surface_of(helpers, volume):
    corners, bricks = helpers.box((1, 1, 1), SIZE)
    return Surface(np.asarray(corners), boundary_triangles(bricks), volume, 1e-3)


def test_a_dented_mesh_gets_its_volume_and_its_patch(helpers, mesh, plastic):
    body = Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic, interface_radius=0.016))
    frames = [AttachmentFrame("/Arm/root", helpers.frame(0.01, 0.01, 0.01), "interface")]
    volume = float(np.prod(SIZE))
    found = shaped(mesh, body, surface_of(helpers, volume), frames)
    assert mesh.quality.volume < 0.999 * volume and found.quality.volume_error < 1e-4
    assert found.quality.source == "surface" and found.quality.frequency_error == 0.01
    (patch,) = found.patches
    assert np.array_equal(patch.origin, frames[0].frame.position)
    corners = {tuple(point) for point in found.points}
    assert all(tuple(point) in corners for point in patch.triangles.reshape(-1, 3))


def test_a_surface_whose_volume_is_not_that_of_the_elements_is_not_fitted(helpers, mesh, plastic):
    body = Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))
    found = shaped(mesh, body, surface_of(helpers, 0.9 * float(np.prod(SIZE))), ())
    assert np.array_equal(found.points, mesh.points) and found.patches == ()


def test_a_mesh_that_has_the_volume_by_chance_is_fitted(helpers, mesh, plastic):
    """Dents and bumps may make up for each other: volume alone does not tell that a mesh follows its surface."""
    body = Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))
    found = shaped(mesh, body, surface_of(helpers, 1.001 * mesh.quality.volume), ())
    assert found.quality.volume_error > 3e-3 and not np.array_equal(found.points, mesh.points)
    assert found.quality.volume == pytest.approx(np.prod(SIZE), rel=1e-4)
