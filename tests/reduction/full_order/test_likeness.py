"""Bodies that are others, turned or mirrored: they are found, and reduced with the factors of the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.tetrahedra import measure_quality
from calmotion.model import Body, FEMesh, FlexibleSettings, Frame
from calmotion.reduction.full_order.likeness import turn_between
from calmotion.reduction.reduce import full_body, reduce_body

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
MIRROR = np.diag([1.0, -1.0, 1.0])
c, s = np.cos(0.7), np.sin(0.7)
TURN = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


@pytest.fixture
def link(helpers, plastic):
    """A tapered bar whose tip lies off its axis, so that no reflection takes it to itself."""
    points, tets = helpers.box((5, 2, 2), (0.2, 0.04, 0.04))
    points = np.asarray(points) - [0.0, 0.02, 0.02]
    points[:, 1] += 0.2 * points[:, 0] + points[:, 2] * points[:, 0]
    body = Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic, elasticity="linear"))
    return points, tets, body


def parts(link, turn=None, move=0.0):
    """Mesh, body, frames and root of the link after an isometry."""
    points, tets, body = link
    turn = np.eye(3) if turn is None else turn
    if np.linalg.det(turn) < 0.0:
        tets = tets[:, [1, 0, 2, 3]]
    moved = np.ascontiguousarray(points @ turn.T + move)
    mesh = FEMesh(0, moved, np.ascontiguousarray(tets), measure_quality(moved, tets))
    ends = [points[np.isclose(points[:, 0], x)].mean(axis=0) @ turn.T + move for x in (0.2, 0.0)]
    names = zip(("/Arm/tip", "/Arm/root"), ends, strict=True)
    return mesh, body, [AttachmentFrame(path, Frame(at, IDENTITY), "interface") for path, at in names], 1


@pytest.mark.parametrize("turn", [np.eye(3), MIRROR, TURN, TURN @ MIRROR])
def test_a_moved_or_mirrored_body_is_reduced_with_the_factors_of_the_first(link, turn):
    first, other = full_body(*parts(link)), full_body(*parts(link, turn, 0.1))
    found = turn_between(first, other)
    np.testing.assert_allclose(found, turn, atol=1e-9)
    other.take(first, found)
    assert other.entries == 0 < first.entries
    mesh, body, frames, root = parts(link, turn, 0.1)
    taken = reduce_body(mesh, body, frames, (), root, full=other)
    alone = reduce_body(mesh, body, frames, (), root)
    np.testing.assert_allclose(taken.stiffness, alone.stiffness, rtol=1e-7)
    compliance = [tip_compliance(reduced) for reduced in (taken, alone)]
    np.testing.assert_allclose(compliance[0], compliance[1], rtol=1e-6, atol=1e-9 * np.abs(compliance[1]).max())


def tip_compliance(reduced):
    tip = np.vstack([reduced.markers[0].Phi, reduced.markers[0].Psi])
    return (tip / reduced.stiffness) @ tip.T


def test_other_bodies_are_not_taken_for_it(link, helpers):
    points, tets, body = link
    first = full_body(*parts(link))
    stiffer = replace(body.flexible.material, youngs_modulus=1.01 * body.flexible.material.youngs_modulus)
    heavier = replace(body.flexible.material, density=1.01 * body.flexible.material.density)
    others = [(points * [1.0, 1.001, 1.0], tets, body), (points, tets[::-1], body)]
    for material in (stiffer, heavier):
        others.append((points, tets, replace(body, flexible=replace(body.flexible, material=material))))
    assert [turn_between(first, full_body(*parts(other))) is None for other in others] == [True, False, True, True]
    smaller = FlexibleSettings(body.flexible.material, interface_radius=0.012, elasticity="linear")
    patched = (points, tets, replace(body, flexible=smaller))
    assert turn_between(first, full_body(*parts(patched))) is None
    more = helpers.box((6, 2, 2), (0.2, 0.04, 0.04))
    assert turn_between(first, full_body(*parts((np.asarray(more[0]) - [0.0, 0.02, 0.02], more[1], body)))) is None
