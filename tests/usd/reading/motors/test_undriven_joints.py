"""What is told of joints without a motor."""

from calmotion.usd.reading import read_shot
from generic_arm import driven, generic
from pxr import UsdPhysics
from small_shots import ELBOW, FRAMES, SHOULDER, TARGET_POSITION, write_arm


def undriven(stage, path=ELBOW):
    prim = stage.GetPrimAtPath(path)
    prim.GetAttribute(TARGET_POSITION).Clear()
    prim.RemoveAPI(UsdPhysics.DriveAPI, "angular")


def swinging(tmp_path, edit):
    """The motors of an arm, and the joints of which is told that what they carry swings."""
    character = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0]
    told = [note.partition(":")[0] for note in character.notes if "carries swings" in note]
    return [motor.path for motor in character.motors], told


def test_a_joint_without_a_drive_swings_and_the_user_is_told(tmp_path):
    assert swinging(tmp_path, undriven) == ([SHOULDER], [ELBOW])


def test_driven_joints_are_not_told_to_swing(tmp_path):
    assert swinging(tmp_path, None) == ([SHOULDER, ELBOW], [])


def test_a_drive_that_pulls_nowhere_is_told_once(tmp_path):
    motors, told = swinging(tmp_path, lambda stage: stage.GetPrimAtPath(ELBOW).GetAttribute(TARGET_POSITION).Clear())
    assert motors == [SHOULDER] and not told


def test_the_axis_of_a_generic_joint_that_nothing_drives_is_named(tmp_path):
    def edit(stage):
        generic(stage, ELBOW, ["rotX", "rotZ"])
        driven(stage, ELBOW, {"rotX": [10.0] * (FRAMES + 1)})

    motors, told = swinging(tmp_path, edit)
    assert motors == [SHOULDER, f"{ELBOW}.rotX"] and told == [f"{ELBOW}.rotZ"]
