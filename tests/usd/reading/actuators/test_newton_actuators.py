"""Actuators of Newton: gains in radians, limits of a DC motor, delays in steps of the physics."""

import math

import pytest
from calmotion.usd.reading import read_shot
from pxr import Sdf, UsdPhysics
from small_shots import ELBOW, write_arm

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


def read(tmp_path, edit):
    character = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0]
    return character.motors[1], character.notes


def test_gains_are_per_radian_and_efforts_are_limited(tmp_path):
    motor, _ = read(tmp_path, lambda stage: actuator(stage, "NewtonMaxEffortClampingAPI", maxEffort=8.0))
    assert (motor.position_gain, motor.velocity_gain) == (100.0, 7.0) and motor.max_torque <= 8.0
    assert motor.damping_on == "joint"
    assert motor.gains_from == "newton:kp and newton:kd of /Actuators/Elbow (Newton)" and motor.delay == 0.0


def test_gains_of_usdphysics_on_the_joint_beat_those_of_an_actuator(tmp_path):
    def edit(stage):
        actuator(stage)
        UsdPhysics.DriveAPI(stage.GetPrimAtPath(ELBOW), "angular").CreateStiffnessAttr(1.0)

    assert read(tmp_path, edit)[0].position_gain == pytest.approx(math.degrees(1.0))


def test_the_clamp_of_a_dc_motor_is_a_no_load_speed_with_a_knee(tmp_path):
    limits = {"maxMotorEffort": 6.0, "saturationEffort": 9.0, "velocityLimit": 12.0}
    motor, _ = read(tmp_path, lambda stage: actuator(stage, "NewtonDCMotorClampingAPI", **limits))
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

    assert read(tmp_path, edit)[0].delay == pytest.approx(delay)


def test_what_is_not_simulated_is_told(tmp_path):
    motor, notes = read(tmp_path, lambda stage: actuator(stage, ki=3.0, constEffort=0.0))
    told = [note for note in notes if "not simulated" in note]
    assert len(told) == 1 and "the integral gain of /Actuators/Elbow" in told[0]
    motor, notes = read(tmp_path, lambda stage: actuator(stage, model="auto"))
    assert motor.model == "prescribed" and motor.position_gain == 100.0


def test_friction_of_physx_is_told_to_be_no_torque(tmp_path):
    def edit(stage):
        actuator(stage)
        stage.GetPrimAtPath(ELBOW).CreateAttribute("physxJoint:jointFriction", FLOAT).Set(0.1)

    motor, notes = read(tmp_path, edit)
    assert motor.rotor.friction == 0.0 and any("physxJoint:jointFriction" in note for note in notes)
