"""Models of motors, and the gains of drives in the dialects, in SI."""

import json

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.catalogs.motor_types import motor_types
from calmotion.model.motor import Rotor
from calmotion.usd.reading import read_shot
from pxr import Sdf, UsdPhysics, Vt
from small_shots import ELBOW, SHOULDER, Scale, set_float, write_arm

MODEL = "calm:motor:model"


def read(tmp_path, edit=None, scale=None):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit, scale)))[0].motors


def model(stage, name):
    prim = stage.GetPrimAtPath(ELBOW)
    prim.AddAppliedSchema("CalmMotorAPI")
    prim.CreateAttribute(MODEL, Sdf.ValueTypeNames.Token).Set(name)


def physics_gains(stage, stiffness, damping=None, kind=None, path=ELBOW):
    drive = UsdPhysics.DriveAPI(stage.GetPrimAtPath(path), "angular")
    drive.CreateStiffnessAttr(stiffness)
    if damping is not None:
        drive.CreateDampingAttr(damping)
    if kind is not None:
        drive.CreateTypeAttr(kind)


def test_motors_are_ideal_unless_a_model_is_authored_and_keep_the_gains_that_were_found(tmp_path):
    shoulder, elbow = read(tmp_path, lambda stage: physics_gains(stage, 2.0, 0.5))
    assert shoulder.model == elbow.model == "prescribed" and shoulder.position_gain == 0.0
    per_degree = 57.29577951308232
    assert (elbow.position_gain, elbow.velocity_gain) == pytest.approx((2.0 * per_degree, 0.5 * per_degree))
    assert elbow.gains_from == "drive:angular:physics:stiffness and drive:angular:physics:damping (UsdPhysics)"


def test_gains_of_calmotion_beat_those_of_other_dialects_in_stage_units(tmp_path):
    def edit(stage):
        model(stage, "drive")
        physics_gains(stage, 2.0)
        set_float(stage, ELBOW, "calm:motor:positionGain", 3e7)  # 3 N m in g cm^2/s^2, per degree
        set_float(stage, ELBOW, "calm:motor:velocityGain", 1e6)

    elbow = read(tmp_path, edit, Scale(0.01, 0.001))[1]
    assert elbow.model == "drive"
    assert (elbow.position_gain, elbow.velocity_gain) == pytest.approx((171.887338539, 5.72957795131))
    assert "Calmotion" in elbow.gains_from


def actuator(stage, kp=100.0, bias=(0.0, -100.0, -7.0), gear=None, to=ELBOW):
    prim = stage.DefinePrim("/Act", "MjcActuator")
    prim.CreateRelationship("mjc:target").SetTargets([to])
    prim.CreateAttribute("mjc:gainPrm", Sdf.ValueTypeNames.DoubleArray).Set(Vt.DoubleArray([kp, 0.0]))
    prim.CreateAttribute("mjc:biasPrm", Sdf.ValueTypeNames.DoubleArray).Set(Vt.DoubleArray(bias))
    if gear:
        prim.CreateAttribute("mjc:gear", Sdf.ValueTypeNames.DoubleArray).Set(Vt.DoubleArray([gear, 0.0]))


def test_position_actuators_of_mujoco_give_gains_in_radians_with_their_gear(tmp_path):
    elbow = read(tmp_path, actuator)[1]
    assert (elbow.position_gain, elbow.velocity_gain) == (100.0, 7.0) and "/Act (MuJoCo)" in elbow.gains_from
    elbow = read(tmp_path, lambda stage: actuator(stage, gear=3.0))[1]
    assert (elbow.position_gain, elbow.velocity_gain) == (900.0, 63.0)
    elbow = read(tmp_path, lambda stage: actuator(stage, bias=(0.0, -100.0, 0.0)))[1]
    assert f"{elbow.velocity_gain:g}" == "0", "reports print no -0"
    motor = read(tmp_path, lambda stage: actuator(stage, bias=(0.0, 0.0, 0.0)))[1]
    assert motor.position_gain == 0.0, "a torque motor holds no position"


def velocities(stage, value, samples=(), authored=""):
    """A drive with a target velocity."""
    physics_gains(stage, 2.0, 0.5)
    attribute = UsdPhysics.DriveAPI(stage.GetPrimAtPath(ELBOW), "angular").CreateTargetVelocityAttr(value)
    for time, sample in enumerate(samples):
        attribute.Set(sample, time)
    if authored:
        damping_on(stage, authored)


def damping_on(stage, what):
    prim = stage.GetPrimAtPath(ELBOW)
    prim.AddAppliedSchema("CalmMotorAPI")
    prim.CreateAttribute("calm:motor:dampingOn", Sdf.ValueTypeNames.Token).Set(what)


def own_gains(stage, authored=""):
    physics_gains(stage, 2.0, 0.5)
    model(stage, "drive")
    set_float(stage, ELBOW, "calm:motor:positionGain", 3.0)
    set_float(stage, ELBOW, "calm:motor:velocityGain", 1.0)
    if authored:
        damping_on(stage, authored)


@pytest.mark.parametrize(
    ("edit", "expected"),
    [
        (lambda s: physics_gains(s, 2.0, 0.5), "joint"),
        (lambda s: velocities(s, 0.0), "joint"),
        (lambda s: velocities(s, 3.0), "error"),
        (lambda s: velocities(s, 0.0, (0.0, 5.0)), "error"),
        (lambda s: velocities(s, 0.0, (0.0, 0.0)), "joint"),
        (lambda s: velocities(s, 0.0, (0.0, 5.0), "joint"), "joint"),
        (actuator, "joint"),
        (lambda s: (actuator(s), damping_on(s, "error")), "error"),
        (own_gains, "error"),
        (lambda s: own_gains(s, "joint"), "joint"),
    ],
    ids=[
        "drive",
        "zero",
        "velocity",
        "velocities",
        "zeros",
        "authored",
        "MuJoCo",
        "known better",
        "own",
        "own authored",
    ],
)
def test_velocity_gain_multiplies_what_its_source_says_unless_authored(tmp_path, edit, expected):
    assert read(tmp_path, edit)[1].damping_on == expected


def with_a_rotor(stage, name="prescribed"):
    actuator(stage)
    model(stage, name)
    for attribute, value in (("mjc:armature", 0.1), ("mjc:damping", 2.0), ("mjc:frictionloss", 0.5)):
        set_float(stage, ELBOW, attribute, value)


def test_gains_of_a_joint_with_inertia_and_friction_of_its_own_are_those_of_a_servo(tmp_path, calmotion):
    motor = read(tmp_path, with_a_rotor)[1]
    assert motor.model == "prescribed" and motor.model_of_gains == "servo"
    assert (motor.rotor.armature, motor.rotor.viscous_friction, motor.rotor.friction) == pytest.approx((0.1, 2.0, 0.5))
    told = " ".join(calmotion("inspect", tmp_path / "arm.usda").stdout.split())
    assert "set calm:motor:model to servo" in told and "0.1 kg m²" in told
    assert read(tmp_path, actuator)[1].model_of_gains == "drive"


def test_a_drive_says_that_it_leaves_inertia_and_friction_out(tmp_path):
    character = read_shot(str(write_arm(tmp_path / "arm.usda", lambda s: with_a_rotor(s, "drive"))))[0]
    assert character.motors[1].rotor == Rotor()
    assert any("without the rotor inertia, friction" in note and ELBOW in note for note in character.notes)


@pytest.mark.parametrize(
    ("low", "high", "more", "expected"),
    [
        (-4.0, 5.0, {}, 12.0),
        (-4.0, 5.0, {"to": SHOULDER}, np.inf),
        (-4.0, 5.0, {"limited": "false"}, np.inf),
        (0.0, 5.0, {}, np.inf),
    ],
    ids=["narrower side", "another joint", "not limited", "one side"],
)
def test_the_range_of_forces_of_an_actuator_times_its_gear_limits_the_torque(tmp_path, low, high, more, expected):
    def edit(stage):
        actuator(stage, gear=3.0, to=more.get("to", ELBOW))
        prim = stage.GetPrimAtPath("/Act")
        for end, value in (("min", low), ("max", high)):
            prim.CreateAttribute(f"mjc:forceRange:{end}", Sdf.ValueTypeNames.Double).Set(value)
        if "limited" in more:
            prim.CreateAttribute("mjc:forceLimited", Sdf.ValueTypeNames.Token).Set(more["limited"])

    assert read(tmp_path, edit)[1].max_torque == expected


def test_inspect_says_what_the_velocity_gains_act_on(tmp_path, calmotion):
    def both(stage):
        actuator(stage)
        physics_gains(stage, 2.0, 0.5, path=SHOULDER)
        shoulder = UsdPhysics.DriveAPI(stage.GetPrimAtPath(SHOULDER), "angular")
        shoulder.CreateTargetVelocityAttr(1.0)

    shot = write_arm(tmp_path / "arm.usda", both)
    told = " ".join(calmotion("inspect", shot).stdout.split())
    assert "The velocity gain of 1 motor acts on the speed of the joint itself" in told and "dampingOn: joint" in told
    assert "The velocity gain of 1 motor acts on the difference" in told and "dampingOn: error" in told
    motors = json.loads(calmotion("inspect", shot, "--json").stdout)["motors"]
    assert {motor["path"]: motor["damping_on"] for motor in motors} == {SHOULDER: "error", ELBOW: "joint"}


def servo(stage, **values):
    model(stage, "servo")
    for name, value in ({"positionGain": 1.0} | values).items():
        set_float(stage, ELBOW, f"calm:motor:{name}", value)


def test_servos_are_read_in_si_from_grams_and_centimetres(tmp_path):
    values = {
        "armature": 2e5, "gearStiffness": 5e7, "gearDamping": 1e4, "friction": 3e6, "viscousFriction": 2e4,
        "frictionSpeed": 2.0, "noLoadSpeed": 360.0, "torqueSpeedKnee": 0.25, "delay": 0.012,
    }  # fmt: skip
    elbow = read(tmp_path, lambda stage: servo(stage, **values), Scale(0.01, 0.001))[1]
    per_degree, turn = 57.29577951308232, 6.283185307179586
    own = elbow.rotor
    assert (own.armature, own.friction, own.knee, elbow.delay) == pytest.approx((0.02, 0.3, 0.25, 0.012))
    assert (own.gear_stiffness, own.gear_damping) == pytest.approx((5 * per_degree, 1e-3 * per_degree))
    assert own.viscous_friction == pytest.approx(2e-3 * per_degree)
    assert (own.friction_speed, own.no_load_speed) == pytest.approx((turn / 180, turn))


def test_rotors_of_other_dialects_have_degrees_or_radians_as_these_do(tmp_path):
    def edit(stage):
        servo(stage)
        for name, value in (("newton:armature", 0.01), ("newton:damping", 0.02), ("mjc:frictionloss", 0.3)):
            set_float(stage, ELBOW, name, value)

    own = read(tmp_path, edit)[1].rotor
    assert (own.armature, own.viscous_friction, own.friction) == pytest.approx((0.01, 0.02 * 57.29577951, 0.3))
    assert own.gear_stiffness == float("inf")
    own = read(tmp_path, lambda stage: (servo(stage), set_float(stage, ELBOW, "mjc:damping", 0.02)))[1].rotor
    assert own.viscous_friction == pytest.approx(0.02)


def test_physx_has_rotors_and_limits_by_axis_in_degrees(tmp_path):
    def edit(stage):
        servo(stage)
        values = {"armature": 0.01, "dynamicFrictionEffort": 0.3, "viscousFrictionCoefficient": 0.02}
        for name, value in (values | {"maxJointVelocity": 90.0}).items():
            set_float(stage, ELBOW, f"physxJointAxis:angular:{name}", value)
        set_float(stage, ELBOW, "physxJoint:armature", 7.0)
        set_float(stage, ELBOW, "physxJoint:maxJointVelocity", 7.0)

    motor = read(tmp_path, edit)[1]
    own = motor.rotor
    assert (own.armature, own.viscous_friction, own.friction) == pytest.approx((0.01, 0.02 * 57.29577951, 0.3))
    assert motor.max_velocity == pytest.approx(np.pi / 2.0)


@pytest.mark.parametrize(
    ("edit", "attribute", "what"),
    [
        (lambda s: model(s, "drive"), "calm:motor:positionGain", "needs a position gain"),
        (lambda s: model(s, "servo"), "calm:motor:positionGain", "model servo needs a position gain"),
        (lambda s: servo(s, armature=-1.0), "calm:motor:armature", "not negative"),
        (lambda s: servo(s, torqueSpeedKnee=1.0), "calm:motor:torqueSpeedKnee", "below 1"),
        (lambda s: servo(s, gearStiffness=0.0), "calm:motor:gearStiffness", "must be positive"),
        (lambda s: servo(s, delay=float("inf")), "calm:motor:delay", "finite"),
        (lambda s: model(s, "drives"), MODEL, "Did you mean drive"),
        (lambda s: damping_on(s, "joints"), "calm:motor:dampingOn", "Did you mean joint"),
        (lambda s: (model(s, "drive"), physics_gains(s, 2.0, -1.0)), "drive:angular:physics:damping", "not negative"),
        (
            lambda s: (model(s, "drive"), physics_gains(s, 2.0, 1.0, "acceleration")),
            "drive:angular:physics:type",
            "accelerations",
        ),
    ],
    ids=[
        "no gain",
        "servo",
        "armature",
        "knee",
        "gear",
        "delay",
        "misspelt",
        "misspelt damping",
        "negative",
        "acceleration",
    ],
)
def test_models_and_gains_that_cannot_be_used_are_refused(tmp_path, edit, attribute, what):
    with pytest.raises(ShotError, match=what) as caught:
        read(tmp_path, edit)
    assert (caught.value.path, caught.value.attribute) == (ELBOW, attribute)


def test_gains_that_no_model_uses_are_not_refused(tmp_path):
    assert read(tmp_path, lambda stage: physics_gains(stage, -2.0))[1].position_gain == 0.0


def written(stage, tokens, **values):
    """A servo with tokens and numbers in its attributes, by names with `__` for `:`."""
    model(stage, "servo")
    prim = stage.GetPrimAtPath(ELBOW)
    for name, value in tokens.items():
        prim.CreateAttribute(f"calm:motor:{name}", Sdf.ValueTypeNames.Token).Set(value)
    for name, value in values.items():
        set_float(stage, ELBOW, f"calm:motor:{name.replace('__', ':')}", value)


def test_laws_of_friction_are_read_in_si_from_grams_and_centimetres(tmp_path):
    values = {
        "friction__stribeck": 3e6, "friction__stribeckSpeed": 90.0, "friction__motorLoad": 0.2,
        "friction__jointLoad": 0.1, "friction__motorQuadratic": 2e-9, "positionGain": 1.0,
    }  # fmt: skip
    elbow = read(tmp_path, lambda stage: written(stage, {"frictionModel": "quadratic"}, **values), Scale(0.01, 0.001))[
        1
    ]
    law = elbow.rotor.law
    assert (law.name, law.stribeck_exponent, law.joint_quadratic) == ("quadratic", 1.0, 0.0)
    assert (law.stribeck, law.stribeck_speed) == pytest.approx((0.3, np.pi / 2))
    assert (law.motor_load, law.joint_load, law.motor_quadratic) == pytest.approx((0.2, 0.1, 0.02))


VOLTS = {"voltage": 7.4, "resistance": 4.0, "torqueConstant": 0.4, "dutyGain": 0.03}


def test_a_motor_fed_with_a_voltage_has_gain_limit_and_back_emf_of_its_winding(tmp_path):
    elbow = read(tmp_path, lambda stage: written(stage, {}, viscousFriction=1e-4, maxDuty=0.9, **VOLTS))[1]
    per_degree = 57.29577951308232
    assert elbow.position_gain == pytest.approx(0.4 / 4.0 * 7.4 * 0.03 * per_degree)
    assert elbow.max_torque == pytest.approx(0.4 / 4.0 * 7.4 * 0.9)
    assert (elbow.rotor.back_emf, elbow.rotor.viscous_friction) == pytest.approx((0.04, 1e-4 * per_degree))

    named = read(tmp_path, lambda stage: written(stage, {"type": "xl330-m288"}, voltage=5.0, dutyGain=0.03))[1].rotor
    kind = motor_types()["xl330-m288"].values
    assert named.back_emf == pytest.approx(kind["torque_constant"] ** 2 / kind["resistance"])
    assert named.back_emf + named.viscous_friction == pytest.approx(kind["viscous_friction"])


@pytest.mark.parametrize(
    ("tokens", "values", "attribute", "what"),
    [
        ({"frictionModel": "stribek"}, {}, "frictionModel", "Did you mean stribeck"),
        ({"frictionModel": "load"}, {"friction__stribeck": 1.0}, "friction:stribeck", "has no such value"),
        ({}, {"friction__load": 0.1}, "friction:load", "has no such value"),
        ({"frictionModel": "load"}, {"friction__load": -0.1}, "friction:load", "not negative"),
        ({"frictionModel": "load"}, {"friction__load": 1.5}, "frictionModel", "takes all torque"),
        ({"frictionModel": "stribeck"}, {"friction__stribeckSpeed": 0.0}, "friction:stribeckSpeed", "finite"),
        ({}, VOLTS | {"positionGain": 1.0}, "positionGain", "by the duty cycle"),
        ({}, VOLTS | {"resistance": -1.0}, "resistance", "positive"),
        ({}, {"voltage": 5.0}, "resistance", "needs it"),
    ],
)
def test_frictions_and_windings_that_cannot_be_are_refused(tmp_path, tokens, values, attribute, what):
    given = {"positionGain": 1.0} | values if "voltage" not in values else values
    with pytest.raises(ShotError, match=what) as caught:
        read(tmp_path, lambda stage: written(stage, tokens, **given))
    assert (caught.value.path, caught.value.attribute) == (ELBOW, f"calm:motor:{attribute}")
