"""Springs and dampers hold what no motor drives."""

import calmotion as cm
import numpy as np
import pytest
from calmotion_plugins.robot_import import import_robot
from pxr import Sdf
from small_shots import ELBOW, SHOULDER, TARGET_POSITION, write_arm

STIFFNESS, DAMPING = 300.0, 0.5  # [N m/rad], [N m s/rad]


def sprung(stage, path=ELBOW, driven=False, ref=0.0):
    """The arm with a spring at a joint, as the converter writes those of MJCF; its stage has no angles in radians."""
    prim = stage.GetPrimAtPath(path)
    if not driven:
        prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")
        prim.RemoveProperty(TARGET_POSITION)
    for name, value in (("mjc:stiffness", STIFFNESS), ("mjc:springref", 10.0), ("mjc:ref", ref)):
        prim.CreateAttribute(name, Sdf.ValueTypeNames.Double).Set(value)
    prim.CreateAttribute("newton:damping", Sdf.ValueTypeNames.Float).Set(float(np.radians(DAMPING)))


@pytest.mark.parametrize("ref", [0.0, 4.0])
def test_a_spring_pulls_its_joint_to_springref(tmp_path, ref):
    made = import_robot(write_arm(tmp_path / "arm.usda", lambda s: sprung(s, ref=ref)), layer=tmp_path / "shot.usda")
    spring = next(motor for motor in made.character.motors if motor.path == ELBOW)
    assert spring.model == "drive" and spring.damping_on == "joint" and not spring.optimize
    assert (spring.position_gain, spring.velocity_gain) == pytest.approx((STIFFNESS, DAMPING))
    assert any("springs of joints are drives" in note and "elbow" in note for note in made.notes)
    motion = cm.simulate(tmp_path / "shot.usda", step=1 / 240, pre_roll=0.0).result.before.motion
    k = made.character.motors.index(spring)
    np.testing.assert_allclose(np.degrees(motion.motor_values[:, k]), 10.0 - ref, atol=1e-6)
    assert np.ptp(motion.motor_efforts[:, k]) > 0.1


def test_a_spring_beside_a_motor_is_told(tmp_path):
    made = import_robot(
        write_arm(tmp_path / "arm.usda", lambda s: sprung(s, driven=True)), layer=tmp_path / "shot.usda"
    )
    assert all(motor.model == "prescribed" for motor in made.character.motors)
    assert any("springs of joints with motors are not read" in note for note in made.notes)


def test_a_robot_on_springs_alone_gets_motors_at_its_joints(tmp_path):
    robot = write_arm(tmp_path / "arm.usda", lambda stage: [sprung(stage, path) for path in (SHOULDER, ELBOW)])
    (tmp_path / "wave.csv").write_text("time_s,shoulder\n0,0\n0.04,0.1\n0.08,0.3\n")
    made = import_robot(robot, layer=tmp_path / "shot.usda", motion=tmp_path / "wave.csv", motors=["shoulder"])
    assert {motor.path: motor.model for motor in made.character.motors} == {SHOULDER: "prescribed", ELBOW: "drive"}
