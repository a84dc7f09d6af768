"""Real robots, read whole."""

import numpy as np
import pytest
from calmotion.usd.reading import read_shot
from calmotion.usd.rigging import RigOptions, rig_shot
from calmotion.usd.writing import write_result
from performing import followed, result_with
from posed_shots import posed
from pxr import Usd, UsdUtils
from real_shots import LOADS, REFUSED, RIGGED, shots_in, tried
from small_shots import FRAMES, write_arm


def test_provenance_says_where_the_shot_came_from(tmp_path):
    path = str(write_arm(tmp_path / "arm.usda"))
    _, animation, provenance = read_shot(path)
    assert provenance.shot == path and provenance.default_prim == "Arm" and provenance.earlier_layers == ()
    assert (provenance.meters_per_unit, provenance.kilograms_per_unit, provenance.up_axis) == (1.0, 1.0, "Z")
    assert (provenance.start_time_code, provenance.end_time_code) == (0.0, FRAMES)
    assert len(animation.frame_times) == FRAMES + 1


def test_a_copy_of_a_mesh_for_collisions_is_not_shown_twice(shared_data):
    character, _, _ = read_shot(str(shared_data / "shots" / "g1_dual_arm_hands_chop.usda"))
    elbow = next(b for b in character.bodies if b.path.endswith("left_elbow_link"))
    assert [s.visible for s in elbow.surfaces] == [True, False]


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


def with_result(tmp_path, edit=None):
    shot = write_arm(tmp_path / "shot.usda", edit)
    character, animation, provenance = read_shot(str(shot))
    result = result_with(character, animation, {0: 0.1, 1: 0.1})
    return shot, write_result(character, animation, provenance, result, str(tmp_path / "calm.usda"))[1]


def notes(path):
    return [note for note in read_shot(str(path))[0].notes if "results" in note]


@pytest.mark.parametrize("edit", [None, posed], ids=["drives", "bodies"])
def test_results_are_told_once_and_have_all_of_their_prims(tmp_path, edit):
    shot, root = with_result(tmp_path, edit)
    (note,) = notes(root)
    assert "calm.usda" in note and notes(shot) == []


def test_results_of_prims_that_were_renamed_are_told(tmp_path):
    shot, root = with_result(tmp_path)
    shot.write_text(shot.read_text().replace("/Arm/joints", "/Arm/motors").replace('"joints"', '"motors"'))
    _, changed, lost = notes(root)
    assert "another version of shot.usda" in changed
    assert lost.startswith("calm.usda: it has results for /Arm/joints/") and "1 more" in lost


def test_results_of_a_shot_that_has_changed_since_are_told(tmp_path):
    shot, root = with_result(tmp_path)
    character, animation, provenance = read_shot(str(root))
    again = result_with(character, animation, {0: 0.2})
    root = write_result(character, animation, provenance, again, str(tmp_path / "again.usda"))[1]
    (tmp_path / "calm_root.usda").write_text((tmp_path / "calm_root.usda").read_text() + "\n")
    assert len(notes(root)) == 1  # a root layer of ours that was written anew is no change
    shot.write_text(shot.read_text().replace("endTimeCode = 24", "endTimeCode = 23"))
    _, changed = notes(root)
    assert changed.startswith("again.usda") and "another version of shot.usda" in changed


def test_a_package_of_a_result_and_its_shot_is_no_other_version(tmp_path):
    _, root = with_result(tmp_path)
    assert UsdUtils.CreateNewUsdzPackage(root, str(tmp_path / "both.usdz"))
    assert len(notes(tmp_path / "both.usdz")) == 1


def test_a_flattened_result_says_what_its_curves_are(tmp_path):
    _, root = with_result(tmp_path)
    Usd.Stage.Open(root).Export(str(tmp_path / "flat.usda"))
    (note,) = notes(tmp_path / "flat.usda")
    assert note.startswith("flat.usda") and "flattened" in note
