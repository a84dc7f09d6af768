"""The estimated error of one mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.geometry.tetrahedra import measure_quality, oriented_tets
from calmotion.reduction.discretization_error import clamped_modes
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.bisection import bisected
from calmotion.reduction.full_order import mesh_estimates
from calmotion.reduction.full_order.mesh_estimates import frequency_estimate, overtaken
from calmotion.reduction.full_order.nested_modes import NestedModes
from calmotion.reduction.interfaces.interface_patches import AttachmentFrame, interface_patches
from calmotion.shot import Body, FEMesh, FlexibleSettings
from skfem import MeshTet


@pytest.fixture(scope="module")
def beam(helpers, plastic):
    return Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))


def mesh_of(helpers, counts):
    points, tets = helpers.box(counts, (0.3, 0.04, 0.03))
    points = np.asarray(points) - [0.0, 0.02, 0.015]
    return FEMesh(0, points, np.asarray(tets), measure_quality(points, tets))


@pytest.mark.parametrize("held", [True, False], ids=["clamped", "free"])
def test_estimates_begun_from_a_coarser_mesh_are_those_without(helpers, beam, held):
    mesh, carrier, nested = mesh_of(helpers, (10, 2, 2)), helpers.frame(0, 0, 0) if held else None, NestedModes()
    for _ in range(3):
        found, alone = (frequency_estimate(mesh, beam, carrier, coarser) for coarser in (nested, None))
        assert found.squares == pytest.approx(alone.squares, rel=1e-3) and found.nodes == alone.nodes
        assert found.error == pytest.approx(alone.error, rel=0.01)
        assert np.abs(found.indicators - alone.indicators).max() < 0.05 * alone.indicators.max()
        points, tets = bisected(mesh.points, mesh.tets, np.argsort(-found.indicators)[: len(mesh.tets) // 3])
        mesh = replace(mesh, points=points, tets=tets)
    assert found.error < 0.7 * frequency_estimate(mesh_of(helpers, (10, 2, 2)), beam, carrier).error


def test_a_later_mode_with_a_large_error_overtakes_the_last():
    squares, honest = np.array([1.0, 2.0, 4.0, 5.0]), np.full(4, 0.1)
    assert overtaken(squares, honest) == 0.0 == overtaken(squares[:3], honest[:3]) == overtaken(squares[:2], honest[:2])
    # it is likely at 5 (1 - 0.22), and the third at 4 (1 - 0.055)
    assert overtaken(squares, np.array([0.1, 0.1, 0.0, 0.4])) == pytest.approx(1.0 - 3.9 / 4.0)


def test_a_thin_flap_overtakes_the_third_mode_on_finer_meshes(helpers, beam):
    """A bar with a flap of 17 x 2 mm, whose mode is the fourth on coarse meshes and the third on finer ones."""
    x, y, z = (
        np.append(np.linspace(0.0, 0.12, 9), 0.137),
        np.linspace(-0.02, 0.02, 4),
        [-0.02, -0.005, 0.01, 0.018, 0.02],
    )
    grid = MeshTet.init_tensor(x, y, np.array(z))
    centers = grid.p[:, grid.t].mean(axis=1)
    kept = (centers[0] < 0.12) | (centers[2] > 0.018)
    used, tets = np.unique(grid.t[:, kept].T, return_inverse=True)
    points = np.ascontiguousarray(grid.p.T[used])
    tets = oriented_tets(points, tets.reshape(-1, 4))[0]
    mesh, nested = FEMesh(0, points, tets, measure_quality(points, tets)), NestedModes()
    held = replace(beam, flexible=replace(beam.flexible, interface_radius=0.05))
    found = []
    for _ in range(5):
        found.append(frequency_estimate(mesh, held, helpers.frame(-0.04, 0.0, 0.0), nested))
        flap = mesh.points[mesh.tets].mean(axis=1)[:, 0] > 0.12
        points, tets = bisected(mesh.points, mesh.tets, np.flatnonzero(flap))
        mesh = replace(mesh, points=points, tets=tets)
    lower = 1.0 - found[-1].squares[2] / found[0].squares[2]
    assert found[-1].overtaken == 0.0 and lower > 0.15 and 0.7 * lower < found[0].overtaken < 1.5 * lower


@pytest.mark.parametrize("coarser", [None, NestedModes()])
def test_a_body_that_its_joint_holds_as_a_whole_cannot_bend(helpers, beam, monkeypatch, coarser):
    monkeypatch.setattr(mesh_estimates, "_clamped_nodes", lambda mesh, *_: np.arange(len(mesh.nodes)))
    with pytest.raises(ShotError, match="nothing of it can bend"):
        frequency_estimate(mesh_of(helpers, (4, 1, 1)), beam, helpers.frame(0, 0, 0), coarser)


def test_what_is_nearer_to_another_joint_is_not_held(helpers, beam):
    mesh = mesh_of(helpers, (20, 2, 2))
    held = replace(beam, flexible=replace(beam.flexible, interface_radius=0.05))
    joints = [AttachmentFrame(f"/Arm/{x}", helpers.frame(x, 0.0, 0.0), "interface") for x in (0.3, 0.06, 0.0)]
    root = joints[2].frame
    alone, beside = (frequency_estimate(mesh, held, root, attachments=given).squares for given in ((), joints))
    assert beside[0] < 0.95 * alone[0]
    # as the reduction holds it
    model = assemble(mesh.points, mesh.tets, held.flexible.material)
    patches = interface_patches(model.mesh, joints, 0.05, held.path)
    frequencies, _ = clamped_modes(model, 3, next(patch.nodes for patch in patches if 2 in patch.attachments))
    assert np.sqrt(beside) / (2.0 * np.pi) == pytest.approx(frequencies, rel=1e-6)
    # frames of which none is that of the parent's joint do not matter
    assert frequency_estimate(mesh, held, root, attachments=joints[:2]).squares == pytest.approx(alone, rel=1e-6)
