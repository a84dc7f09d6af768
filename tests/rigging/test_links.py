"""Which joints become links, and which links matter."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.mesh.moments import surface_moments
from calmotion.rigging.links import make_links, targets_of, tip_of
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
