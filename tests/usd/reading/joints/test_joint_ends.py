"""An end of a joint that names something is not taken for the world."""

import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import Sdf, UsdPhysics
from small_shots import ELBOW, FORE, write_arm

ROOT = """#usda 1.0
(
    defaultPrim = "Arm"
    metersPerUnit = 1
    upAxis = "Z"
    startTimeCode = 0
    endTimeCode = 24
)
def "Arm" (
    references = @./robot.usda@</Arm>
)
{
%s
}
"""


def referenced(tmp_path, body="", over=""):
    """The arm without one of its bodies, which is beside it and out of the reference's reach."""

    def edit(stage):
        layer = stage.GetRootLayer()
        Sdf.CopySpec(layer, FORE, layer, "/Fore")
        stage.RemovePrim(FORE)
        UsdPhysics.Joint(stage.GetPrimAtPath(ELBOW)).GetBody1Rel().SetTargets([body] if body else [])

    write_arm(tmp_path / "robot.usda", edit)
    (tmp_path / "shot.usda").write_text(ROOT % over)
    return str(tmp_path / "shot.usda")


def test_a_body_that_a_reference_does_not_reach_is_refused(tmp_path):
    with pytest.raises(ShotError, match="outside of what is referenced") as error:
        read_shot(referenced(tmp_path, "/Fore"))
    assert (error.value.path, error.value.attribute) == (ELBOW, "physics:body1")
    assert "/Fore in robot.usda" in error.value.found


@pytest.mark.parametrize("edit", ["rel physics:body1 = []", "delete rel physics:body1 = </Fore>"])
def test_an_end_that_a_stronger_layer_gives_to_the_world_is_there(tmp_path, edit):
    path = referenced(tmp_path, "/Fore", f'over "joints"\n{{\nover "elbow"\n{{\n{edit}\n}}\n}}')
    character, _, _ = read_shot(path)
    (elbow,) = [joint for joint in character.joints if joint.path == ELBOW]
    assert elbow.body0 == -1


@pytest.mark.parametrize("kind", ["Xform", "Scope", ""])
def test_places_in_the_world_are_ends(tmp_path, kind):
    def edit(stage):
        stage.DefinePrim("/Ground", kind)
        UsdPhysics.Joint(stage.GetPrimAtPath("/Arm/joints/stand")).CreateBody0Rel().SetTargets(["/Ground"])

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert len(character.joints) == 3
