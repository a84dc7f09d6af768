"""Robots and characters that nobody here made: all load, or are refused with a reason that one can act on."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.usd.reading import read_shot
from calmotion.usd.rigging import RigOptions, rig_shot
from performing import followed
from real_shots import LOADS, REFUSED, RIGGED, shots_in, tried

LOADED = {
    "converted/g1_dual_arm/g1_dual_arm.usda": (LOADS, 14),
    "converted/kuka_iiwa_14/iiwa14.usda": (LOADS, 7),
    "converted/robotiq_2f85/robotiq_2f85.usda": (LOADS, 2),
    "robots/newton_small/boxes_hinged.usda": (LOADS, 1),
    "shots/dr_legs_walk.usda": (LOADS, 12),
    "shots/g1_dual_arm_disco.usda": (LOADS, 14),
    "shots/g1_dual_arm_hands_chop.usda": (LOADS, 14),
    "skel/CesiumMan/CesiumMan.usdz": (RIGGED, None),
    "skel/OpenUSD/arm.usda": (RIGGED, 1),
    "skel/OpenUSD/skinnedArm.usda": (RIGGED, 1),
    "skel/RiggedFigure/RiggedFigure.usdz": (RIGGED, None),
    "skel/RiggedSimple/RiggedSimple.usdz": (RIGGED, 1),
}


@pytest.fixture(scope="module")
def rows(shared_data):
    return {row.file: row for row in tried(shared_data)}


def test_every_shot_loads_or_is_refused_with_a_place_and_a_remedy(rows, shared_data):
    assert set(rows) == {path.relative_to(shared_data).as_posix() for path in shots_in(shared_data)}
    for name, row in rows.items():
        if name in LOADED:
            outcome, motors = LOADED[name]
            assert row.outcome == outcome and motors in (None, row.motors), row
        else:  # files that were added later may load as well
            assert row.outcome != REFUSED or row.reason.count(". ") >= 1, row


def test_a_missing_reference_is_reported_once_with_the_file(rows):
    reason = rows["robots/dr_legs/usd/dr_legs.usda"].reason
    assert "Geometry/surfaces.usd" in reason and "30 other prims" in reason and reason.count("cannot be opened") == 1


def test_a_gripper_of_a_conversion_is_driven_through_its_tendon_and_its_gear(shared_data):
    character, animation, _ = read_shot(str(shared_data / "converted/robotiq_2f85/robotiq_2f85.usda"), still=True)
    left, right = (motor for motor in character.motors)
    if left.follows is not None:
        left, right = right, left
    assert left.path.endswith("left_driver_joint") and right.path.endswith("right_driver_joint")
    assert right.follows is not None and right.follows.ratio == 1.0 and right.follows.offset == 0.0
    assert all(np.abs(track.values).max() < 1e-6 for track in animation.tracks)


def test_limits_of_a_conversion_are_read(shared_data):
    character, _, _ = read_shot(str(shared_data / "converted/g1_dual_arm/g1_dual_arm.usda"), still=True)
    assert all(np.isfinite(motor.max_torque) and motor.max_torque > 0.0 for motor in character.motors)
    assert any("mjc:actuatorfrcrange (MuJoCo)" in note for note in character.notes)


@pytest.mark.parametrize(
    "name", ["RiggedSimple/RiggedSimple.usdz", "RiggedFigure/RiggedFigure.usdz", "CesiumMan/CesiumMan.usdz",
             "OpenUSD/skinnedArm.usda", "OpenUSD/arm.usda"],
)  # fmt: skip
def test_a_robot_of_a_skeleton_does_what_the_skeleton_does(shared_data, tmp_path, name):
    layer = tmp_path / "rig.usda"
    rig = rig_shot(str(shared_data / "skel" / name), str(layer), RigOptions(angle_tolerance=1e-7))
    far, turned = followed(layer, rig.robot)
    assert far < 1e-6 and turned < 1e-6


def test_the_hinge_rotates_by_the_animated_angle(shared_data, tmp_path):
    rig = rig_shot(str(shared_data / "skel/RiggedSimple/RiggedSimple.usdz"), str(tmp_path / "rig.usda"))
    (joint,) = rig.joints
    assert len(joint.motors) == 1
    _, animation, _ = read_shot(str(tmp_path / "rig.usda"))
    assert np.degrees(np.ptp(animation.tracks[0].values)) == pytest.approx(34.4, abs=0.1)
