"""The estimated error of one mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.geometry.tetrahedra import measure_quality
from calmotion.reduction.elements.bisection import bisected
from calmotion.reduction.full_order import mesh_estimates
from calmotion.reduction.full_order.mesh_estimates import frequency_estimate
from calmotion.reduction.full_order.nested_modes import NestedModes
from calmotion.shot import Body, FEMesh, FlexibleSettings


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


@pytest.mark.parametrize("coarser", [None, NestedModes()])
def test_a_body_that_its_joint_holds_as_a_whole_cannot_bend(helpers, beam, monkeypatch, coarser):
    monkeypatch.setattr(mesh_estimates, "_clamped_nodes", lambda mesh, *_: np.arange(len(mesh.nodes)))
    with pytest.raises(ShotError, match="nothing of it can bend"):
        frequency_estimate(mesh_of(helpers, (4, 1, 1)), beam, helpers.frame(0, 0, 0), coarser)
