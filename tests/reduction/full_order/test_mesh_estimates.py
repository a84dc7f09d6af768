"""The estimated error of one mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh.bisection import bisected
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches
from calmotion.mesh.tetrahedra import measure_quality
from calmotion.model import Body, FEMesh, FlexibleSettings
from calmotion.reduction.discretization_error import clamped_modes
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.full_order import mesh_estimates
from calmotion.reduction.full_order.mesh_estimates import frequency_estimate


@pytest.fixture(scope="module")
def beam(helpers, plastic):
    return Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))


def mesh_of(helpers, counts):
    points, tets = helpers.box(counts, (0.3, 0.04, 0.03))
    points = np.asarray(points) - [0.0, 0.02, 0.015]
    return FEMesh(0, points, np.asarray(tets), measure_quality(points, tets))


@pytest.mark.parametrize("held", [True, False], ids=["clamped", "free"])
def test_elements_that_are_bisected_where_the_error_is_leave_less_of_it(helpers, beam, held):
    mesh, carrier = mesh_of(helpers, (10, 2, 2)), helpers.frame(0, 0, 0) if held else None
    for _ in range(3):
        found = frequency_estimate(mesh, beam, carrier)
        points, tets = bisected(mesh.points, mesh.tets, np.argsort(-found.indicators)[: len(mesh.tets) // 3])
        mesh = replace(mesh, points=points, tets=tets)
    assert found.error < 0.7 * frequency_estimate(mesh_of(helpers, (10, 2, 2)), beam, carrier).error


def test_a_body_that_its_joint_holds_as_a_whole_cannot_bend(helpers, beam, monkeypatch):
    monkeypatch.setattr(mesh_estimates, "_clamped_nodes", lambda mesh, *_: np.arange(len(mesh.nodes)))
    with pytest.raises(ShotError, match="nothing of it can bend"):
        frequency_estimate(mesh_of(helpers, (4, 1, 1)), beam, helpers.frame(0, 0, 0))


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
