"""Patches of the surface that joints hold."""

import numpy as np
import pytest
import trimesh
from calmotion.errors import ShotError
from calmotion.mesh.bisection import bisected
from calmotion.mesh.mesh_shaping import Surface
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches, spans_a_plane
from calmotion.mesh.quadratic import quadratic_mesh


@pytest.fixture(scope="module")
def beam(helpers):
    return quadratic_mesh(*helpers.box((20, 2, 2), (0.6, 0.02, 0.02), origin=(0, -0.01, -0.01)))


@pytest.fixture
def attachment(helpers):
    return lambda name, *position, kind="interface": AttachmentFrame(name, helpers.frame(*position), kind)


def test_a_given_radius_takes_the_surface_within_it(beam, attachment):
    """By area, so that a patch does not grow or shrink by an element as the mesh happens to lie."""
    center = np.array([0.3, 0.0, 0.01])
    (patch,) = interface_patches(beam, [attachment("/j", *center)], 0.025, "/b")
    distance = np.linalg.norm(beam.nodes - center, axis=1)
    surface = np.isin(np.arange(len(beam.nodes)), beam.surface_nodes)
    inside = np.flatnonzero(surface & (distance <= 0.025))
    assert np.isin(patch.nodes, beam.surface_nodes).all()
    assert len(np.setxor1d(patch.nodes, inside)) <= 0.1 * len(inside)
    assert distance[patch.nodes].max() < 0.03
    # nearest first: none is left out that is nearer than one that is in
    out = np.setdiff1d(np.flatnonzero(surface), patch.nodes)
    assert distance[out].min() >= distance[patch.nodes].max() - 1e-12


def test_patches_never_share_a_node_and_anchors_at_one_place_share_a_patch(beam, attachment):
    attachments = [
        attachment("/a", 0.28, 0, 0.01), attachment("/t", 0.1, 0, 0, kind="point"),
        attachment("/b", 0.32, 0, 0.01), attachment("/c", 0.28, 0, 0.01),
    ]  # fmt: skip
    first, second = interface_patches(beam, attachments, 0.05, "/b")
    assert first.attachments == (0, 3) and second.attachments == (2,)
    assert not np.intersect1d(first.nodes, second.nodes).size
    assert (beam.nodes[first.nodes, 0] <= 0.3 + 1e-12).all() and (beam.nodes[second.nodes, 0] >= 0.3 - 1e-12).all()


def test_a_radius_that_leaves_nothing_to_bend_is_refused_with_the_size_of_the_body(beam, attachment, helpers):
    ends = [attachment("/a", 0.0, 0.0, 0.0), attachment("/b", 0.1, 0.0, 0.0)]
    size = float(np.linalg.norm(np.ptp(beam.nodes, axis=0)))
    with pytest.raises(ShotError, match="smaller radius") as wrong:
        interface_patches(beam, ends, 5.0, "/Arm/link")
    assert wrong.value.attribute == "calm:flexible:interfaceRadius" and f"{size:.4g} m" in (wrong.value.found or "")
    cube = quadratic_mesh(*helpers.box((4, 4, 4), (0.1, 0.1, 0.1), origin=(0.0, -0.05, -0.05)))
    with pytest.raises(ShotError, match="nothing of the body is left"):
        interface_patches(cube, ends, 0.15, "/Arm/link")
    assert len(interface_patches(cube, ends, 0.05, "/Arm/link")) == 2


def test_a_radius_finer_than_the_mesh_takes_the_triangle_that_is_touched(beam, attachment):
    (patch,) = interface_patches(beam, [attachment("/j", 0.312, 0.003, 0.01)], 1e-3, "/b")
    assert len(patch.nodes) == 6 and spans_a_plane(beam.nodes[patch.nodes])


def test_a_given_radius_that_reaches_nothing_counts_from_the_nearest_place(beam, attachment):
    (far,) = interface_patches(beam, [attachment("/Arm/elbow", 0.3, 0.0, 0.11)], 0.02, "/Arm/link")
    (near,) = interface_patches(beam, [attachment("/Arm/elbow", 0.3, 0.0, 0.01)], 0.02, "/Arm/link")
    assert np.array_equal(far.nodes, near.nodes) and len(far.nodes) > 6
    # one that reaches the body is used as it is
    (wide,) = interface_patches(beam, [attachment("/Arm/elbow", 0.3, 0.0, 0.11)], 0.12, "/Arm/link")
    assert len(wide.nodes) > len(near.nodes)


def test_an_anchor_in_the_air_holds_the_nearest_place(beam, attachment):
    (far,) = interface_patches(beam, [attachment("/j", 0.3, 0.0, 0.1)], -1.0, "/b")
    (near,) = interface_patches(beam, [attachment("/j", 0.3, 0.0, 0.01)], -1.0, "/b")
    assert np.array_equal(far.nodes, near.nodes) and len(far.nodes) >= 6


def test_two_anchors_beyond_one_end_divide_it(beam, attachment):
    frames = [attachment("/a", -0.1, 0.02, 0.0), attachment("/b", -0.1, -0.02, 0.0)]
    first, second = interface_patches(beam, frames, -1.0, "/b")
    assert len(first.nodes) >= 6 and len(second.nodes) >= 6 and not np.intersect1d(first.nodes, second.nodes).size
    assert beam.nodes[np.union1d(first.nodes, second.nodes), 0].max() < 0.1


def test_anchors_closer_to_each_other_than_the_elements_all_get_a_patch(beam, attachment):
    frames = [attachment(f"/{k}", 0.3 + 0.004 * k, 0.0, 0.01) for k in range(4)]
    patches = interface_patches(beam, frames, -1.0, "/b")
    assert [patch.attachments for patch in patches] == [(0,), (1,), (2,), (3,)]
    assert all(spans_a_plane(beam.nodes[patch.nodes]) for patch in patches)
    nodes = np.concatenate([patch.nodes for patch in patches])
    assert len(np.unique(nodes)) == len(nodes)


def test_joints_without_room_for_a_patch_each_hold_one_together(beam, attachment):
    near = [attachment("/a", 0.3, 0.0, 0.01), attachment("/b", 0.302, 0.0, 0.01), attachment("/c", 0.5, 0.0, 0.01)]
    first, second = interface_patches(beam, near, -1.0, "/b")
    assert first.attachments == (0, 1) and second.attachments == (2,)
    (alone,) = interface_patches(beam, near[:1], -1.0, "/b")
    assert np.array_equal(first.nodes, alone.nodes)
    apart = [near[0], attachment("/b", 0.33, 0.0, 0.01)]
    assert [patch.attachments for patch in interface_patches(beam, apart, -1.0, "/b")] == [(0,), (1,)]


def test_surface_is_left_between_patches_that_would_meet(helpers, attachment):
    """Two bores' axes so near to each other that the spheres about them overlap; both are off the surface."""
    box = quadratic_mesh(*helpers.box((24, 24, 2), (0.06, 0.06, 0.005), origin=(-0.03, -0.03, 0.0)))
    frames = [attachment("/a", -0.01, 0.0, 0.025), attachment("/b", 0.01, 0.0, 0.025)]
    first, second = interface_patches(box, frames, 0.04, "/b")
    places = [frame.frame.position for frame in frames]
    for patch, own, other in ((first, *places), (second, *places[::-1])):
        at = box.nodes[patch.nodes]
        nearer = np.linalg.norm(at - own, axis=1) / np.linalg.norm(at - other, axis=1)
        assert nearer.max() < 0.45 / 0.55 + 1e-9 and len(at) > 20 and len(patch.balls) == 1
    between = np.abs(box.nodes[box.surface_nodes, 0]) < 0.002
    assert not np.isin(box.surface_nodes[between], np.union1d(first.nodes, second.nodes)).any()


def test_the_patch_of_a_bore_is_a_band_of_its_wall(helpers, attachment):
    points, tets = helpers.box((8, 8, 2), (0.1, 0.1, 0.02), origin=(-0.05, -0.05, -0.01))
    center = points[tets].mean(axis=1)
    tets = tets[np.abs(center[:, :2]).max(axis=1) > 0.025]
    used = np.unique(tets)
    ring = quadratic_mesh(points[used], np.searchsorted(used, tets).astype(np.int32))
    (patch,) = interface_patches(ring, [attachment("/j", 0, 0, 0)], -1.0, "/b")
    assert np.abs(ring.nodes[patch.nodes][:, :2]).max() < 0.049
    for direction in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        assert (ring.nodes[patch.nodes][:, :2] @ direction).max() >= 0.025 - 1e-12


@pytest.mark.parametrize("pin", [0.25, 0.5])
def test_a_casting_is_not_held_by_a_detail_that_the_frame_of_its_joint_touches(pin, attachment, helpers):
    """A pin of half a millimetre across on 756 cm^3: it was held by 1.25 mm of it."""
    points, tets = helpers.box((12, 9, 7), (0.12, 0.09, 0.07), origin=(-0.06, -0.045, -0.07))
    points = np.asarray(points)
    for _ in range(12):
        points, tets, _ = bisected(points, tets, np.argsort(np.linalg.norm(points[tets].mean(axis=1), axis=1))[:20])
    block = trimesh.creation.box((120.0, 90.0, 70.0), trimesh.transformations.translation_matrix((0.0, 0.0, -35.0)))
    casting = trimesh.boolean.union([block, trimesh.creation.cylinder(pin, 2.0, sections=12)])
    skin = Surface(1e-3 * np.array(casting.vertices), np.array(casting.faces), 1e-9 * casting.volume, 1e-3)
    mesh = quadratic_mesh(points, tets)
    at = [attachment("/roll", 0.0, 0.0, 1e-3), attachment("/pitch", 0.06, 0.0, -0.035)]
    held, _ = interface_patches(mesh, at, -1.0, "/casting", meshed=skin)
    assert np.ptp(mesh.nodes[held.nodes], axis=0)[:2].min() > 0.04
    # by a radius that the shot gives, as it says
    given, _ = interface_patches(mesh, at, 2e-3, "/casting", meshed=skin)
    assert np.ptp(mesh.nodes[given.nodes], axis=0).max() < 5e-3


def test_contact_places_next_to_each_other_divide_what_is_there(attachment, helpers):
    """Two frames above one place, 0.3 mm aside: each was held by a seventh of a millimetre."""
    mesh = quadratic_mesh(*helpers.box((12, 9, 7), (0.12, 0.09, 0.07), origin=(-0.06, -0.045, -0.07)))
    at = [attachment("/a", 0.0, 0.0, 0.05), attachment("/b", 0.0003, 0.0, 0.08)]
    patches = interface_patches(mesh, at, -1.0, "/casting")
    assert len(patches) == 2 and not np.intersect1d(patches[0].nodes, patches[1].nodes).size
    assert all(np.ptp(mesh.nodes[patch.nodes], axis=0).max() > 0.02 for patch in patches)
