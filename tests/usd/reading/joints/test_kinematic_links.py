"""A kinematic body that joints hold as well is refused by name, and not as a closed chain that does not meet."""

from calmotion.usd.reading import read_shot
from pxr import Gf, Sdf, UsdGeom, UsdPhysics
from shot_edits import undriven
from small_shots import BASE, ELBOW, FORE, SHOULDER, TARGET_POSITION, write_arm


def kinematic(*paths):
    def edit(stage):
        for path in paths:
            UsdPhysics.RigidBodyAPI(stage.GetPrimAtPath(path)).CreateKinematicEnabledAttr(True)

    return edit


def read(tmp_path, *edits):
    def edit(stage):
        for one in edits:
            one(stage)

    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0]


def test_a_root_may_be(tmp_path):
    assert len(read(tmp_path, kinematic(BASE)).joints) == 3
    assert len(read(tmp_path, kinematic(BASE), lambda stage: stage.RemovePrim("/Arm/joints/stand")).joints) == 3


def test_two_handles_between_which_something_hangs_may_be(tmp_path):
    def moving(stage):
        place = UsdGeom.Xformable(stage.GetPrimAtPath(BASE)).GetOrderedXformOps()[0]
        for code in (0, 24):
            place.Set(Gf.Vec3d(0.001 * code, 0.0, 1.0), code)
        stage.RemovePrim("/Arm/joints/stand")

    character = read(tmp_path, undriven, moving, kinematic(BASE, FORE))
    assert sum(joint.body0 == -1 for joint in character.joints) == 2


def test_a_motor_that_gives_may_be_between(tmp_path):
    def soft(stage):
        for path in (SHOULDER, ELBOW):
            prim = stage.GetPrimAtPath(path)
            prim.AddAppliedSchema("CalmMotorAPI")
            prim.CreateAttribute("calm:motor:model", Sdf.ValueTypeNames.Token).Set("drive")
            prim.CreateAttribute("drive:angular:physics:stiffness", Sdf.ValueTypeNames.Float).Set(10.0)
            assert prim.GetAttribute(TARGET_POSITION)

    assert len(read(tmp_path, kinematic(FORE), soft).joints) == 4
