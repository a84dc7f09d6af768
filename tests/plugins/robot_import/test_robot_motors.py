"""Motors of robots that are USD: what is driven stays, otherwise all joints are, but not those of a closed chain."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from calmotion_plugins.robot_import import import_robot
from generic_arm import generic
from pxr import Sdf, UsdPhysics
from small_shots import BASE, ELBOW, FORE, SHOULDER, TARGET_POSITION, clear_mass, write_arm


def undriven(stage, paths=(SHOULDER, ELBOW)) -> None:
    for path in paths:
        prim = stage.GetPrimAtPath(path)
        prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")
        prim.RemoveProperty(TARGET_POSITION)


def test_a_usd_robot_without_motors_is_refused_with_the_command_that_makes_them(tmp_path):
    path = write_arm(tmp_path / "arm.usda", undriven)
    with pytest.raises(ShotError, match="none of its joints is driven") as refused:
        read_shot(str(path))
    assert "`calmotion import arm.usda -o robot.usda`" in refused.value.remedy
    character, _, _ = read_shot(str(path), still=True)
    assert not character.motors and any("its joints move freely" in note for note in character.notes)


def test_a_usd_robot_gets_motors_and_a_motion_where_it_is(tmp_path):
    (tmp_path / "robots").mkdir()
    robot = write_arm(tmp_path / "robots" / "arm.usda", undriven)
    (tmp_path / "wave.csv").write_text("time_s,shoulder,elbow\n0,0,0.1\n0.04,0.1,0.2\n0.08,0.3,0.2\n")
    before = robot.read_bytes()
    made = import_robot(robot, layer=tmp_path / "shot.usda", motion=tmp_path / "wave.csv")
    assert made.folder == "" and robot.read_bytes() == before
    layer = Sdf.Layer.FindOrOpen(str(tmp_path / "shot.usda"))
    assert list(layer.subLayerPaths) == ["./robots/arm.usda"]
    _, animation, _ = read_shot(str(tmp_path / "shot.usda"))
    np.testing.assert_allclose(animation.tracks[0].values, [0.0, 0.1, 0.3], atol=1e-6)
    assert animation.frame_times[-1] == pytest.approx(0.08)


def test_a_usd_robot_keeps_its_animation_and_clock_and_the_rest_moves_freely(tmp_path):
    robot = write_arm(tmp_path / "arm.usda", lambda stage: undriven(stage, [ELBOW]))
    made = import_robot(robot, layer=tmp_path / "shot.usda")
    expected = read_shot(str(robot))[1]
    assert len(made.character.motors) == 1 and any("--motors all" in note for note in made.notes)
    np.testing.assert_allclose(made.animation.frame_times, expected.frame_times)
    np.testing.assert_allclose(made.animation.tracks[0].values, expected.tracks[0].values)
    both = import_robot(robot, layer=tmp_path / "shot.usda", motors=["all"])
    assert [motor.path for motor in both.character.motors] == [SHOULDER, ELBOW]


def test_axes_of_a_generic_joint_are_named_and_driven(tmp_path):
    robot = write_arm(tmp_path / "arm.usda", lambda s: (undriven(s), generic(s, ELBOW, ["rotX", "rotZ"])))
    (tmp_path / "wave.csv").write_text("time_s,elbow.rotZ\n0,0\n0.04,0.1\n0.08,0.3\n")
    made = import_robot(robot, layer=tmp_path / "shot.usda", motion=tmp_path / "wave.csv", motors=["elbow.*"])
    assert [motor.path for motor in made.character.motors] == [f"{ELBOW}.rotX", f"{ELBOW}.rotZ"]
    np.testing.assert_allclose(made.animation.tracks[1].values, [0.0, 0.1, 0.3], atol=1e-6)


def test_not_all_joints_of_a_closed_chain_can_be_motors(tmp_path):
    def closed(stage):
        undriven(stage)
        extra = UsdPhysics.RevoluteJoint.Define(stage, "/Arm/joints/close")
        extra.CreateBody0Rel().SetTargets([BASE])
        extra.CreateBody1Rel().SetTargets([FORE])

    robot = write_arm(tmp_path / "arm.usda", closed)
    with pytest.raises(ShotError, match="closed chain") as refused:
        import_robot(robot, layer=tmp_path / "shot.usda")
    assert refused.value.attribute == "--motors" and "shoulder, elbow, close" in str(refused.value.found)
    assert not (tmp_path / "shot.usda").exists()
    made = import_robot(robot, layer=tmp_path / "shot.usda", motors=["shoulder"])
    assert [motor.path for motor in made.character.motors] == [SHOULDER]


def test_a_robot_without_hinges_and_sliders_is_refused(tmp_path):
    def balls(stage):
        undriven(stage)
        for path in (SHOULDER, ELBOW):
            stage.GetPrimAtPath(path).SetTypeName("PhysicsSphericalJoint")

    robot = write_arm(tmp_path / "arm.usda", balls)
    with pytest.raises(ShotError, match="no joint that a motor can drive") as refused:
        import_robot(robot, layer=tmp_path / "shot.usda")
    assert "PhysicsSphericalJoint" in str(refused.value.found) and "leave it passive" in refused.value.remedy


def test_solid_gives_bodies_without_mass_that_of_their_geometry(tmp_path):
    robot = write_arm(tmp_path / "arm.usda", lambda s: (undriven(s), clear_mass(s, FORE)))
    with pytest.raises(ShotError, match="without mass"):
        import_robot(robot, layer=tmp_path / "shot.usda")
    made = import_robot(robot, layer=tmp_path / "shot.usda", solid="abs")
    fore = next(body for body in made.character.bodies if body.path == FORE)
    assert fore.mass.mass == pytest.approx(1050.0 * 0.4 * 0.04**2, rel=0.05)


def test_the_robot_itself_is_never_written_to(tmp_path):
    robot = write_arm(tmp_path / "arm.usda", undriven)
    with pytest.raises(ShotError, match="never written to"):
        import_robot(robot, layer=robot)
