"""A joint between the cheeks of a fork holds the cheeks, not what its sphere just reaches of the ground."""

import numpy as np
import pytest
from calmotion.mesh.patches import interface_patches as module
from calmotion.mesh.patches.cut_patches import with_rims
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches
from calmotion.mesh.patches.sphere_cut import just_reached
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.mesh.tetrahedra import surface_area
from calmotion.model import Body, FlexibleSettings, Frame

GAP, GROUND = 0.03, -0.037  # from the joint in the origin to the cheeks, and to the ground between them


def fork(helpers, cells):
    """Points and tetrahedra of a fork along z, its cheeks 10 mm thick."""
    points, tets = helpers.box((8 * cells, 4 * cells, 10 * cells), (0.08, 0.08, 0.1), origin=(-0.04, -0.04, -0.057))
    points = np.asarray(points)
    x, _, z = points[tets].mean(axis=1).T
    tets = tets[(np.abs(x) > GAP) | (z < GROUND)]
    used = np.unique(tets)
    return points[used], np.searchsorted(used, tets).astype(np.int32)


@pytest.fixture(scope="module")
def joint(helpers):
    return AttachmentFrame("/Robot/pin", helpers.frame(0.0, 0.0, 0.0), "interface")


def on_ground(x):
    return (np.abs(x[..., 2] - GROUND) < 1e-9) & (np.abs(x[..., 0]) < GAP - 1e-9)


def test_a_bore_around_the_axis_is_held(helpers):
    """A ring as far from the axis as the ground of a fork, and a plate that the axis passes through."""
    angle = 2.0 * np.pi * np.arange(24) / 24
    ring = 0.9 * np.stack([np.cos(angle), np.sin(angle), np.zeros(24)], axis=1)
    k, n = np.arange(24), (np.arange(24) + 1) % 24
    wall = np.concatenate([ring - [0, 0, 0.1], ring + [0, 0, 0.1]])
    around = np.concatenate([np.stack([k, n, n + 24], 1), np.stack([k, n + 24, k + 24], 1)])
    plate = np.array([[0.5, 0.0, 0.8], [-0.3, 0.5, 0.8], [-0.3, -0.5, 0.8]])
    points, last = np.concatenate([wall, plate]), np.array([[48, 49, 50]])
    axis, center = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    assert not just_reached(points, np.concatenate([around, last]), center, 1.0, axis, np.inf).any()
    some = np.concatenate([around[np.tile(k < 5, 2)], last])  # of the ring on one side
    assert just_reached(points, some, center, 1.0, axis, np.inf).tolist() == [True] * 10 + [False]
    assert not just_reached(points, some, center, 1.0, beyond=np.inf).any()


def test_a_measured_patch_holds_the_cheeks_and_a_given_one_what_is_within_its_radius(helpers, joint):
    """The measured radius is that of a ball of a quarter more than the gap, or farther."""
    points, tets = fork(helpers, 2)
    mesh = quadratic_mesh(points, tets)
    (patch,) = interface_patches(mesh, [joint], -1.0, "/Robot/fork")
    assert patch.radius > -GROUND  # else this test shows nothing
    x = mesh.nodes[patch.nodes]
    assert not on_ground(x).any()
    assert {-1.0, 1.0} <= set(np.sign(x[:, 0]))
    (given,) = interface_patches(mesh, [joint], patch.radius, "/Robot/fork")
    assert on_ground(mesh.nodes[given.nodes]).any()


@pytest.mark.parametrize("cells, radius", [(1, 0.0375), (1, 0.0378), (1, 0.0388), (2, 0.0378), (2, 0.0395)])
def test_a_cut_patch_of_a_measured_radius_has_no_ground_and_the_area_of_the_cheeks(
    helpers, plastic, monkeypatch, cells, radius
):
    monkeypatch.setattr(module, "automatic_radius", lambda *_: radius)
    across = Frame(np.zeros(3), np.array([1.0, 0.0, 1.0, 0.0]) / np.sqrt(2.0))  # its axis is x
    points, tets = fork(helpers, cells)
    body = Body("/Robot/fork", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))
    points, tets, ((_, held),) = with_rims(points, tets, body, [AttachmentFrame("/Robot/pin", across, "interface")])
    assert not on_ground(points[held].mean(axis=1)).any()
    assert surface_area(points, held) == pytest.approx(2.0 * np.pi * (radius**2 - GAP**2), rel=0.006)
