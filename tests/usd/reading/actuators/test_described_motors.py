"""Motors that are named: what they stand for, what beats them, and names that do not fit."""

import json
import math

import pytest
from calmotion import ShotError
from calmotion.tolerance.motors.motor_effects import with_gains_used
from calmotion.usd.reading import read_shot
from pxr import Sdf, UsdPhysics
from small_shots import ELBOW, set_float, write_arm


def named(stage, name, model="auto"):
    prim = stage.GetPrimAtPath(ELBOW)
    prim.AddAppliedSchema("CalmMotorAPI")
    for attribute, value in (("type", name), ("model", model)):
        prim.CreateAttribute(f"calm:motor:{attribute}", Sdf.ValueTypeNames.Token).Set(value)


def read(tmp_path, edit):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0]


def test_a_named_motor_has_what_its_table_says(tmp_path):
    motor = read(tmp_path, lambda stage: named(stage, "XM430-W350", "servo")).motors[1]
    assert (motor.kind, motor.model, motor.position_gain, motor.velocity_gain) == ("xm430-w350", "servo", 21.1, 0.0)
    assert (motor.rotor.armature, motor.rotor.friction, motor.rotor.viscous_friction) == (0.045, 0.03, 1.084)
    assert motor.max_torque == 4.1 and motor.max_velocity == pytest.approx(46 * math.pi / 30)
    assert motor.backlash == pytest.approx(math.radians(0.25)) and motor.rotor.gear_stiffness == math.inf
    assert motor.damping_on == "error"
    assert "xm430-w350" in motor.gains_from and "Haarnoja" in motor.gains_from


def test_what_is_authored_beats_the_named_motor_and_this_beats_other_dialects(tmp_path):
    def edit(stage):
        named(stage, "xm430-w350", "servo")
        UsdPhysics.DriveAPI(stage.GetPrimAtPath(ELBOW), "angular").CreateStiffnessAttr(9.0)
        for name, value in (("newton:armature", 9.0), ("mjc:frictionloss", 9.0), ("calm:motor:backlash", 1.5)):
            set_float(stage, ELBOW, name, value)
        set_float(stage, ELBOW, "calm:motor:viscousFriction", math.radians(0.5))
        set_float(stage, ELBOW, "calm:motor:maxVelocity", 90.0)
        set_float(stage, ELBOW, "calm:motor:maxTorque", math.inf)

    motor = read(tmp_path, edit).motors[1]
    assert motor.position_gain == 21.1 and motor.rotor.armature == 0.045 and motor.rotor.friction == 0.03
    assert motor.rotor.viscous_friction == pytest.approx(0.5) and motor.backlash == pytest.approx(math.radians(1.5))
    assert motor.max_velocity == pytest.approx(math.pi / 2) and motor.max_torque == math.inf


def test_an_authored_position_gain_goes_with_the_named_motors_velocity_gain(tmp_path):
    def edit(stage):
        named(stage, "unitree-5020", "drive")
        set_float(stage, ELBOW, "calm:motor:positionGain", math.radians(80.0))

    motor = read(tmp_path, edit).motors[1]
    assert (motor.position_gain, motor.velocity_gain) == pytest.approx((80.0, 1.5))


def test_a_named_motor_is_ideal_unless_a_model_is_authored_but_its_effects_are_those_of_a_servo(tmp_path):
    character = read(tmp_path, lambda stage: named(stage, "xm430-w350"))
    assert character.motors[1].model == "prescribed" and character.motors[1].rotor.armature == 0.045
    assert [motor.model for motor in with_gains_used(character).motors] == ["prescribed", "servo"]


def test_a_motor_of_the_users_table_is_found(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CONFIG", str(tmp_path))
    (tmp_path / "motors.toml").write_text("[mine]\nposition_gain = 7\nbacklash = 0.5\n")
    assert read(tmp_path, lambda stage: named(stage, "mine", "drive")).motors[1].position_gain == 7.0


@pytest.mark.parametrize(
    ("name", "model", "attribute", "what"),
    [
        ("xm430-w35", "servo", "calm:motor:type", "Did you mean xm430-w350"),
        ("slide", "servo", "calm:motor:type", "moves along an axis, but the joint turns"),
        ("sg90", "servo", "calm:motor:positionGain", "needs a position gain"),
    ],
)
def test_names_that_do_not_fit_are_refused(tmp_path, monkeypatch, name, model, attribute, what):
    monkeypatch.setenv("CALMOTION_CONFIG", str(tmp_path))
    (tmp_path / "motors.toml").write_text("[slide]\nlinear = true\nposition_gain = 7\n")
    with pytest.raises(ShotError, match=what) as caught:
        read(tmp_path, lambda stage: named(stage, name, model))
    assert (caught.value.path, caught.value.attribute) == (ELBOW, attribute)


def test_inspect_lists_the_named_motor_and_what_it_would_do(tmp_path, calmotion):
    shot = write_arm(tmp_path / "arm.usda", lambda stage: named(stage, "xm430-w350"))
    told = json.loads(calmotion("inspect", shot, "--json").stdout)
    motor = told["motors"][1]
    assert motor["type"] == "xm430-w350" and motor["rotor"]["armature_kg_m2"] == 0.045
    assert motor["backlash_rad"] == pytest.approx(math.radians(0.25))
    assert "xm430-w350" in calmotion("inspect", shot).stdout


FLOAT = Sdf.ValueTypeNames.Float


def actuator(stage, *applied, model="servo", **values):
    prim = stage.DefinePrim("/Actuators/Elbow", "NewtonActuator")
    prim.CreateRelationship("newton:targets").SetTargets([ELBOW])
    for name in ("NewtonPDControlAPI", *applied):
        prim.AddAppliedSchema(name)
    for name, value in ({"kp": 100.0, "kd": 7.0} | values).items():
        kind = Sdf.ValueTypeNames.Int if isinstance(value, int) else FLOAT
        prim.CreateAttribute(f"newton:{name}", kind).Set(value)
    joint = stage.GetPrimAtPath(ELBOW)
    joint.AddAppliedSchema("CalmMotorAPI")
    joint.CreateAttribute("calm:motor:model", Sdf.ValueTypeNames.Token).Set(model)


def read_newton(tmp_path, edit):
    character = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0]
    return character.motors[1], character.notes


def test_gains_are_per_radian_and_efforts_are_limited(tmp_path):
    motor, _ = read_newton(tmp_path, lambda stage: actuator(stage, "NewtonMaxEffortClampingAPI", maxEffort=8.0))
    assert (motor.position_gain, motor.velocity_gain) == (100.0, 7.0) and motor.max_torque <= 8.0
    assert motor.damping_on == "joint"
    assert motor.gains_from == "newton:kp and newton:kd of /Actuators/Elbow (Newton)" and motor.delay == 0.0


def test_gains_of_usdphysics_on_the_joint_beat_those_of_an_actuator(tmp_path):
    def edit(stage):
        actuator(stage)
        UsdPhysics.DriveAPI(stage.GetPrimAtPath(ELBOW), "angular").CreateStiffnessAttr(1.0)

    assert read_newton(tmp_path, edit)[0].position_gain == pytest.approx(math.degrees(1.0))


def test_the_clamp_of_a_dc_motor_is_a_no_load_speed_with_a_knee(tmp_path):
    limits = {"maxMotorEffort": 6.0, "saturationEffort": 9.0, "velocityLimit": 12.0}
    motor, _ = read_newton(tmp_path, lambda stage: actuator(stage, "NewtonDCMotorClampingAPI", **limits))
    own = motor.rotor
    assert own.no_load_speed == 12.0 and own.knee == pytest.approx(1.0 - 6.0 / 9.0)
    # at the knee both branches of Newton's clamp meet: saturation (1 - v / limit) = largest
    assert 9.0 * (1.0 - own.knee) == pytest.approx(6.0)


@pytest.mark.parametrize(("rate", "delay"), [(500, 0.006), (None, 0.003)])
def test_a_delay_is_counted_in_steps_of_the_physics(tmp_path, rate, delay):
    def edit(stage):
        actuator(stage, "NewtonActuatorDelayAPI", delaySteps=3)
        scene = next((p for p in stage.Traverse() if p.GetTypeName() == "PhysicsScene"), None)
        scene = scene or UsdPhysics.Scene.Define(stage, "/Scene").GetPrim()
        if rate:
            scene.CreateAttribute("newton:timeStepsPerSecond", Sdf.ValueTypeNames.Int).Set(rate)

    assert read_newton(tmp_path, edit)[0].delay == pytest.approx(delay)


def test_what_is_not_simulated_is_told(tmp_path):
    motor, notes = read_newton(tmp_path, lambda stage: actuator(stage, ki=3.0, constEffort=0.0))
    told = [note for note in notes if "not simulated" in note]
    assert len(told) == 1 and "the integral gain of /Actuators/Elbow" in told[0]
    motor, notes = read_newton(tmp_path, lambda stage: actuator(stage, model="auto"))
    assert motor.model == "prescribed" and motor.position_gain == 100.0


def test_friction_of_physx_is_told_to_be_no_torque(tmp_path):
    def edit(stage):
        actuator(stage)
        stage.GetPrimAtPath(ELBOW).CreateAttribute("physxJoint:jointFriction", FLOAT).Set(0.1)

    motor, notes = read_newton(tmp_path, edit)
    assert motor.rotor.friction == 0.0 and any("physxJoint:jointFriction" in note for note in notes)
