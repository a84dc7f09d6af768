"""Which joints become links, and which links matter."""

import numpy as np
import pytest
from calmotion.mesh.moments import is_closed, surface_moments
from calmotion.rigging.links import cut_skin, make_links, targets_of, tip_of
from scipy.spatial.transform import Rotation
from tubes import tube

JOINTS = ("hips", "hips/spine", "hips/spine/arm", "hips/spine/arm/hand", "hips/spine/arm/hand/finger", "hips/leg")
PARENTS = (-1, 0, 1, 2, 3, 0)
LENGTH = 6.0
POINTS, TRIANGLES = tube(cells=12, length=LENGTH)


def turns(moving, count=12):
    """Rotations in which some joints turn about z."""
    found = np.tile(np.eye(3), (count, len(JOINTS), 1, 1))
    for joint in moving:
        found[:, joint] = Rotation.from_rotvec(np.linspace(0.0, 1.0, count)[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    return found


def weights(pieces):
    """Slices of the tube, of equal length, for some of the joints."""
    found = np.zeros((len(POINTS), len(JOINTS)))
    slices = np.clip((POINTS[:, 0] / LENGTH * len(pieces)).astype(int), 0, len(pieces) - 1)
    found[np.arange(len(POINTS)), np.array(pieces)[slices]] = 1.0
    return found


def links(moving, pieces=tuple(range(6)), joints=JOINTS, parents=PARENTS):
    count = len(joints)
    return make_links(joints, parents, turns(moving)[:, :count], (POINTS, TRIANGLES), weights(pieces)[:, :count], 1e-6)


def volume(link):
    return surface_moments(*link.piece).volume if link.piece else 0.0


def test_a_joint_that_rests_is_part_of_the_one_above_it():
    found = links((2, 4))
    assert [JOINTS[link.joint] for link in found] == ["hips", "hips/spine/arm", "hips/spine/arm/hand/finger"]
    assert [link.parent for link in found] == [-1, 0, 1]
    # hips, spine and leg; arm and hand; finger
    assert np.argsort([-volume(link) for link in found]).tolist() == [0, 1, 2]
    assert sum(volume(link) for link in found) == pytest.approx(LENGTH * 0.04)


def test_what_rests_together_is_cut_as_one_solid():
    (whole,) = links(())
    assert len(whole.piece[0]) == len(POINTS)


def test_a_joint_that_turns_nothing_is_left_out():
    found = links((2, 4), pieces=(0, 2, 3))
    assert [JOINTS[link.joint] for link in found] == ["hips", "hips/spine/arm"]


def test_a_joint_without_geometry_that_carries_some_is_kept():
    found = links((1, 2), pieces=(0, 3))
    assert [(JOINTS[link.joint], link.piece is not None) for link in found] == [
        ("hips", True), ("hips/spine", False), ("hips/spine/arm", True)
    ]  # fmt: skip


def test_names_are_unique_and_can_be_names_of_prims():
    found = links((1, 2), (0, 1, 2), ("a b", "a b/1", "a b/1/a.b"), (-1, 0, 1))
    assert [link.name for link in found] == ["a_b", "_1", "a_b_2"]


def test_targets_are_hands_rather_than_their_fingers_and_the_ends_of_other_limbs():
    found = links((1, 2, 3, 4, 5))
    assert [JOINTS[found[k].joint].split("/")[-1] for k in targets_of(found, JOINTS)] == ["hand", "leg"]


def test_a_tip_is_the_far_end_of_a_link():
    assert tip_of((POINTS, TRIANGLES), np.zeros(3))[0] > 0.9 * LENGTH


def weights_of(points, joints, length=2.0):
    along = np.clip((points[:, 0] / length * joints).astype(int), 0, joints - 1)
    return np.eye(joints)[along]


def test_pieces_are_closed_outward_and_make_up_the_whole():
    points, triangles = tube()
    pieces = cut_skin(points, triangles, weights_of(points, 2))
    assert set(pieces) == {0, 1}
    for x, t in pieces.values():
        assert is_closed(t, x)
        a, b, c = (x[t[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", np.cross(b - a, c - a), a) > 0.0
    volumes = [surface_moments(x, t).volume for x, t in pieces.values()]
    assert np.isclose(sum(volumes), 0.2 * 0.2 * 2.0)


def test_seams_of_the_skin_are_no_cuts():
    points, triangles = tube()
    # every triangle with corners of its own, as exporters make for texture seams
    loose, own = points[triangles.ravel()], np.arange(triangles.size, dtype=np.int32).reshape(-1, 3)
    pieces = cut_skin(loose, own, weights_of(loose, 2))
    assert np.isclose(sum(surface_moments(x, t).volume for x, t in pieces.values()), 0.08)
    assert all(is_closed(t, x) for x, t in pieces.values())


def test_a_joint_without_triangles_has_no_piece():
    points, triangles = tube()
    weights = np.zeros((len(points), 3))
    weights[:, 1] = 1.0
    assert set(cut_skin(points, triangles, weights)) == {1}


def test_a_sheet_is_not_a_body():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert cut_skin(points, np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.ones((4, 1))) == {}


def test_an_inward_skin_is_reoriented():
    points, triangles = tube()
    (x, t), *_ = cut_skin(points, triangles[:, ::-1].copy(), np.ones((len(points), 1))).values()
    a, b, c = (x[t[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", np.cross(b - a, c - a), a) > 0.0
