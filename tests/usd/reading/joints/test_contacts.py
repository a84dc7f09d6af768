"""CalmContactAPI in a stage: which feet are held and when, floating bases, and what is refused."""

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.character import contact_joints
from pxr import Gf, UsdGeom
from steppers import ANKLE, LANDING, RATE, ROBOT, TORSO, write_stepper

SOLE = f"{ROBOT}/left/Foot/Sole"


def test_contacts_are_joints_that_come_and_go(tmp_path):
    shot = cm.open_shot(write_stepper(tmp_path / "stepper.usda"))
    joints = [shot.character.joints[k] for k in contact_joints(shot.character)]
    assert [joint.path for joint in joints] == [SOLE, f"{ROBOT}/right/Foot/Sole"]
    left = joints[0]
    assert left.kind == "fixed" and left.body0 == -1 and left.contact.friction == -1.0
    assert shot.character.bodies[left.body1].path == f"{ROBOT}/left/Foot"
    np.testing.assert_allclose(left.frame0.position, [0.0, 0.05, 0.0], atol=1e-7)
    np.testing.assert_allclose(left.frame1.position, [0.0, 0.0, -ANKLE], atol=1e-7)
    np.testing.assert_allclose(left.contact.times, [0.0, LANDING / RATE])
    holds = [left.contact.holds_at(time) for time in (-1.0, 0.0, LANDING / RATE - 1e-3, LANDING / RATE, 9.0)]
    assert holds == [True, True, True, False, False]


def test_a_base_that_only_contacts_hold_floats(tmp_path):
    shot = cm.open_shot(write_stepper(tmp_path / "stepper.usda"))
    (base,) = [joint for joint in shot.character.joints if joint.kind == "floating"]
    assert base.path == TORSO and any("its contacts hold it" in note for note in shot.character.notes)


def test_an_animated_base_counts_at_the_first_frame_alone(tmp_path):
    def moved(stage):
        place = stage.GetPrimAtPath(TORSO).GetAttribute("xformOp:translate")
        for frame in range(25):
            place.Set(Gf.Vec3d(0.004 * frame, 0, 0.8), frame)

    shot = cm.open_shot(write_stepper(tmp_path / "stepper.usda", moved))
    assert any(joint.kind == "floating" for joint in shot.character.joints)
    assert any("counts at the first frame alone" in note for note in shot.character.notes)
    result = cm.simulate(shot, step=1 / 48)
    assert result.targets[f"{TORSO}/Head"].error.max() < 1e-5


def test_points_and_friction_are_read(tmp_path):
    def rough(stage):
        stage.GetPrimAtPath(SOLE).GetAttribute("calm:contact:friction").Set(0.6)

    shot = cm.open_shot(write_stepper(tmp_path / "stepper.usda", rough, kind="point"))
    left = shot.character.joints[contact_joints(shot.character)[0]]
    assert left.kind == "spherical" and left.contact.friction == pytest.approx(0.6)


def elsewhere(stage):
    prim = UsdGeom.Xform.Define(stage, f"{ROBOT}/Mat").GetPrim()
    prim.ApplyAPI("CalmContactAPI")


def kind(stage):
    stage.GetPrimAtPath(SOLE).GetAttribute("calm:contact:kind").Set("claw")


def negative(stage):
    stage.GetPrimAtPath(SOLE).GetAttribute("calm:contact:friction").Set(-0.3)


@pytest.mark.parametrize(
    ("edit", "path", "attribute"),
    [
        (elsewhere, f"{ROBOT}/Mat", "apiSchemas"),
        (kind, SOLE, "calm:contact:kind"),
        (negative, SOLE, "calm:contact:friction"),
    ],
)
def test_what_is_no_contact_is_refused(tmp_path, edit, path, attribute):
    with pytest.raises(ShotError) as error:
        cm.open_shot(write_stepper(tmp_path / "stepper.usda", edit))
    assert path in str(error.value) and attribute in str(error.value)
