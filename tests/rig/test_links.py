"""Which joints become links, and which links matter."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.rig.links import make_links, targets_of, tip_of
from scipy.spatial.transform import Rotation
from tubes import tube

JOINTS = ("hips", "hips/spine", "hips/spine/arm", "hips/spine/arm/hand", "hips/spine/arm/hand/finger", "hips/leg")
PARENTS = (-1, 0, 1, 2, 3, 0)
PIECE = tube(cells=2)


def turns(moving, count=12):
    """Rotations in which some joints turn about z."""
    found = np.tile(np.eye(3), (count, len(JOINTS), 1, 1))
    for joint in moving:
        found[:, joint] = Rotation.from_rotvec(np.linspace(0.0, 1.0, count)[:, None] * [0.0, 0.0, 1.0]).as_matrix()
    return found


def links(moving, pieces=range(6)):
    return make_links(JOINTS, PARENTS, turns(moving), {joint: PIECE for joint in pieces}, 1e-6)


def test_a_joint_that_rests_is_part_of_the_one_above_it():
    found = links((2, 4))
    assert [JOINTS[link.joint] for link in found] == ["hips", "hips/spine/arm", "hips/spine/arm/hand/finger"]
    assert [link.parent for link in found] == [-1, 0, 1]
    assert [len(link.pieces) for link in found] == [3, 2, 1]  # hips, spine, leg; arm, hand; finger


def test_a_joint_that_turns_nothing_is_left_out():
    found = links((2, 4), pieces=(0, 2, 3))
    assert [JOINTS[link.joint] for link in found] == ["hips", "hips/spine/arm"]


def test_a_joint_without_geometry_that_carries_some_is_kept():
    found = links((1, 2), pieces=(0, 3))
    assert [(JOINTS[link.joint], len(link.pieces)) for link in found] == [
        ("hips", 1), ("hips/spine", 0), ("hips/spine/arm", 1)
    ]  # fmt: skip


def test_names_are_unique_and_can_be_names_of_prims():
    joints = ("a b", "a b/1", "a b/1/a.b")
    found = make_links(joints, (-1, 0, 1), turns((1, 2))[:, :3], {k: PIECE for k in range(3)}, 1e-6)
    assert [link.name for link in found] == ["a_b", "_1", "a_b_2"]


def test_targets_are_hands_rather_than_their_fingers_and_the_ends_of_other_limbs():
    found = links((1, 2, 3, 4, 5))
    assert [JOINTS[found[k].joint].split("/")[-1] for k in targets_of(found, JOINTS)] == ["hand", "leg"]


def test_a_tip_is_the_far_end_of_a_link():
    (link, *_) = links((2,))
    assert tip_of(link, np.zeros(3)) == pytest.approx([2.0, 0.0, 0.0])
