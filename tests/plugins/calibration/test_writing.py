"""Layers of calibrations: values in stage units, read back as the robot that was estimated."""

import dataclasses
import json

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.cli.main import main
from calmotion.usd import stages
from calmotion.usd.reading import read_shot
from calmotion_plugins.calibration.model.estimates import Calibration, ChannelFit, Estimate
from calmotion_plugins.calibration.writing import write_calibration
from pxr import Sdf, Usd
from scipy.spatial.transform import Rotation
from small_shots import BASE, ELBOW, FORE, PLASTIC, SHOULDER, Scale, make_flexible, make_target, set_float, write_arm


def estimate(kind, path, nominal, value, sd=0.01, axis=-1, logarithmic=True, identifiable=True):
    return Estimate(kind, path, axis, "", nominal, 0.3 * abs(nominal) or 0.3, value, sd, logarithmic, identifiable)


def calibration_of(*estimates):
    count = len(estimates)
    covariance = 1e-4 * (0.5 * np.eye(count) + 0.5 * np.ones((count, count)))
    return Calibration(estimates, covariance, {"take.csv": "ab12"}, (), (), True, 5, 40, 1e-3, 0.1, 1.0)


@pytest.fixture(params=[Scale(), Scale(0.01, 0.001)], ids=["m, kg", "cm, g"])
def shot(tmp_path, request):
    scale = request.param

    def edit(stage):
        make_flexible(stage, FORE, scale)
        make_target(stage)
        joint = stage.GetPrimAtPath(SHOULDER)
        joint.AddAppliedSchema("CalmMotorAPI")
        joint.CreateAttribute("calm:motor:model", Sdf.ValueTypeNames.Token).Set("servo")
        unit = scale.kilograms * scale.meters**2
        set_float(stage, SHOULDER, "drive:angular:physics:stiffness", 100.0 * np.deg2rad(1.0) / unit)
        set_float(stage, SHOULDER, "drive:angular:physics:damping", 2.0 * np.deg2rad(1.0) / unit)
        set_float(stage, SHOULDER, "calm:motor:armature", 0.01 / unit)
        set_float(stage, SHOULDER, "calm:motor:friction", 0.1 / unit)

    return str(write_arm(tmp_path / "arm.usda", edit, scale))


ALL = (
    estimate("modulus", PLASTIC, 2e9, 2.3e9, 2e7), estimate("damping", PLASTIC, 0.01, 0.02, 1e-3),
    estimate("density", PLASTIC, 1100.0, 1000.0), estimate("mass", BASE, 2.0, 2.5),
    estimate("centre", BASE, 0.0, 0.02, axis=0, logarithmic=False), estimate("position_gain", SHOULDER, 100.0, 80.0),
    estimate("armature", SHOULDER, 0.01, 0.012), estimate("friction", SHOULDER, 0.1, 0.3),
    estimate("delay", SHOULDER, 0.0, 0.008, 2e-4, logarithmic=False),
    estimate("encoder_offset", ELBOW, 0.0, 0.02, 1e-3, logarithmic=False),
    estimate("clock_offset", "take.csv", 0.0, 3.2, logarithmic=False),
)  # fmt: skip


def test_the_shot_with_the_layer_is_the_calibrated_robot(shot, tmp_path):
    character, _, provenance = read_shot(shot)
    layer, root = write_calibration(character, provenance, calibration_of(*ALL), str(tmp_path / "robot.usda"))
    found, _, _ = read_shot(root)
    fore = next(body for body in found.bodies if body.path == FORE)
    material = fore.flexible.material
    assert material.youngs_modulus == pytest.approx(2.3e9, rel=1e-6) and material.damping_ratio == pytest.approx(0.02)
    assert material.density == pytest.approx(1000.0, rel=1e-6)
    base = next(body for body in found.bodies if body.path == BASE)
    assert base.mass.mass == pytest.approx(2.5, rel=1e-6) and base.mass.center == pytest.approx([0.02, 0.0, 0.0])
    assert np.diag(base.mass.inertia) == pytest.approx(1.25 * 0.01 * np.ones(3), rel=1e-5)
    motor = next(motor for motor in found.motors if motor.path == SHOULDER)
    assert motor.position_gain == pytest.approx(80.0, rel=1e-6) and motor.delay == pytest.approx(0.008)
    assert motor.velocity_gain == pytest.approx(2.0, rel=1e-6)  # read from the same dialect as the new gain
    assert motor.damping_on == next(own.damping_on for own in character.motors if own.path == SHOULDER) == "joint"
    assert (motor.rotor.armature, motor.rotor.friction) == (pytest.approx(0.012), pytest.approx(0.3))
    assert layer.endswith("robot.usda") and stages.role_of(Sdf.Layer.FindOrOpen(layer)) == stages.CALIBRATION


def test_each_value_has_its_standard_deviation_and_the_layer_the_recordings(shot, tmp_path):
    character, _, provenance = read_shot(shot)
    layer, root = write_calibration(character, provenance, calibration_of(*ALL), str(tmp_path / "robot.usda"))
    stage = Usd.Stage.Open(root)
    modulus = stage.GetPrimAtPath(PLASTIC).GetAttribute("physics:youngsModulus")
    entry = modulus.GetCustomDataByKey("calmotion")
    assert entry["standard_deviation"] / modulus.Get() == pytest.approx(2e7 / 2.3e9, rel=1e-6) and entry["identifiable"]
    assert stage.GetPrimAtPath(ELBOW).GetCustomDataByKey("calmotion")["encoder_offset"] == pytest.approx(0.02)
    entry = Sdf.Layer.FindOrOpen(layer).customLayerData["calmotion"]["calibration"]
    assert list(entry["recordings_sha256"]) == ["ab12"] and list(entry["parameters"])[-1] == "clock_offset take.csv"


def test_robust_curves_get_the_covariance_of_what_recordings_narrow_wide_as_it_is(shot, tmp_path):
    character, _, provenance = read_shot(shot)
    lost = dataclasses.replace(ALL[1], standard_deviation=0.29 * ALL[1].value, identifiable=False)
    wide = dataclasses.replace(ALL[3], standard_deviation=0.22 * ALL[3].value, identifiable=False)
    made = calibration_of(ALL[0], lost, wide, ALL[8], ALL[10])
    _, root = write_calibration(character, provenance, made, str(tmp_path / "robot.usda"))
    known = read_shot(root)[0].retarget.uncertainty.calibrated
    assert known.names == (f"modulus {PLASTIC}", f"mass {BASE}", f"delay {SHOULDER}")
    # the delay is known in seconds, and drawn as a factor
    assert np.array(known.covariance)[0] == pytest.approx([1e-4, 5e-5, 5e-5 / 0.008])
    assert read_shot(shot)[0].retarget.uncertainty.calibrated.names == ()


def test_a_second_calibration_lies_on_the_first(shot, tmp_path):
    character, _, provenance = read_shot(shot)
    _, first = write_calibration(character, provenance, calibration_of(ALL[0]), str(tmp_path / "first.usda"))
    character, _, provenance = read_shot(first)
    _, second = write_calibration(character, provenance, calibration_of(ALL[3]), str(tmp_path / "second.usda"))
    found = read_shot(second)[0]
    fore = next(body for body in found.bodies if body.path == FORE)
    assert fore.flexible.material.youngs_modulus == pytest.approx(2.3e9, rel=1e-6)
    assert found.retarget.uncertainty.calibrated.names == (f"mass {BASE}", f"modulus {PLASTIC}")


def test_the_shot_is_never_overwritten_and_the_layer_alone_is_no_shot(shot, tmp_path):
    character, _, provenance = read_shot(shot)
    with pytest.raises(ShotError, match="input layers are never written"):
        write_calibration(character, provenance, calibration_of(ALL[0]), shot)
    layer, _ = write_calibration(character, provenance, calibration_of(ALL[0]), str(tmp_path / "robot.usda"))
    with pytest.raises(ShotError, match="_root"):
        read_shot(layer)


def test_metadata_that_were_damaged_tell_nothing(shot, tmp_path):
    character, _, provenance = read_shot(shot)
    layer, root = write_calibration(character, provenance, calibration_of(ALL[0]), str(tmp_path / "robot.usda"))
    file, name = tmp_path / "robot.usda", "covariance_of_log_factors = ["
    file.write_text(file.read_text().replace(name, f"{name}-1, "))
    Sdf.Layer.FindOrOpen(layer).Reload(True)
    assert read_shot(root)[0].retarget.uncertainty.calibrated.names == ()


@pytest.mark.parametrize("largest", [None, 0.6])
def test_a_servo_fed_with_a_voltage_gets_a_factor_of_its_gain_that_any_shot_of_it_takes(tmp_path, largest):
    def edit(gain):
        def author(stage):
            make_target(stage)
            joint = stage.GetPrimAtPath(SHOULDER)
            joint.AddAppliedSchema("CalmMotorAPI")
            for name, value in (("model", "servo"), ("type", "xl330-m288")):
                joint.CreateAttribute(f"calm:motor:{name}", Sdf.ValueTypeNames.Token).Set(value)
            set_float(stage, SHOULDER, "calm:motor:positionGain", gain)
            set_float(stage, SHOULDER, "calm:motor:maxTorque", 0.7)

        return author

    shot, other = (str(write_arm(tmp_path / f"{k}.usda", edit(gain))) for k, gain in enumerate((0.01, 0.04)))
    character, _, provenance = read_shot(shot)
    own = character.motors[0]
    rows = (
        estimate("position_gain", SHOULDER, own.position_gain, 1.2 * own.position_gain),
        estimate("viscous_friction", SHOULDER, own.rotor.viscous_friction, 0.01),
        estimate("load_friction", SHOULDER, own.rotor.law.share, 0.3),
        *([] if largest is None else [estimate("max_torque", SHOULDER, 0.7, largest)]),
    )
    layer, _ = write_calibration(character, provenance, calibration_of(*rows), str(tmp_path / "robot.usda"))
    stage = Usd.Stage.CreateNew(str(tmp_path / "both.usda"))
    stage.GetRootLayer().subLayerPaths = [layer, other]
    for name in ("defaultPrim", "metersPerUnit", "kilogramsPerUnit", "upAxis", "timeCodesPerSecond", "endTimeCode"):
        stage.GetRootLayer().pseudoRoot.SetInfo(name, Sdf.Layer.FindOrOpen(other).pseudoRoot.GetInfo(name))
    stage.Save()
    found = read_shot(str(tmp_path / "both.usda"))[0].motors[0]
    assert found.position_gain == pytest.approx(4.0 * 1.2 * own.position_gain, rel=1e-6)
    assert found.max_torque == pytest.approx(largest or 1.2 * 0.7) and found.rotor.law.share == pytest.approx(0.3)
    assert found.rotor.back_emf == pytest.approx(1.2 * own.rotor.back_emf, rel=1e-6)
    assert found.rotor.viscous_friction == pytest.approx(0.01, rel=1e-6)


def test_what_recordings_were_off_is_told_with_the_shot_of_the_layer(shot, tmp_path):
    own = read_shot(shot)
    fits = (
        ChannelFit("a.csv", f"angle {SHOULDER}", "rad", 9, 3, 1e-3, 0.1, 0.01, 0.02, 0, 0.05),
        ChannelFit("a.csv", "marker /Arm/Hand", "m", 9, 0, 1e-3, 0.1, 0.001, float("nan"), 0, 0.002),
    )
    made = dataclasses.replace(calibration_of(estimate("modulus", PLASTIC, 2e9, 2.1e9)), channels=fits)
    _, root = write_calibration(own[0], own[2], made, str(tmp_path / "robot.usda"))
    target = max(own[0].targets, key=lambda t: t.path)
    arm = np.linalg.norm(own[0].bodies[target.body].rest.position - own[0].bodies[0].rest.position)
    (note,) = [note for note in read_shot(root)[0].notes if "differed from its recordings" in note]
    found = [float(part.split()[-1]) for part in note.split(" mm")[:2]]
    assert found[1] / found[0] == pytest.approx(2.5, rel=0.02) and found[0] > 0.5 * 20.0 * arm
    calibrated = read_shot(root)[0].retarget.uncertainty.calibrated
    assert 1e3 * calibrated.largest_error_m == pytest.approx(found[1], rel=0.01)


def test_reports_of_a_calibrated_shot_tell_the_error_with_what_its_recordings_were_off(shot, tmp_path, capsys):
    own = read_shot(shot)
    fits = (ChannelFit("a.csv", "marker /Arm/Hand", "m", 9, 3, 1e-3, 0.1, 0.001, 0.002, 0, 0.004),)
    made = dataclasses.replace(calibration_of(estimate("modulus", PLASTIC, 2e9, 2.1e9)), channels=fits)
    _, root = write_calibration(own[0], own[2], made, str(tmp_path / "robot.usda"))
    assert main(["simulate", root, "--json", "--step", "0.01"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["calibration_error_m"] == pytest.approx(0.004)
    assert report["max_error_with_calibration_m"] == pytest.approx(np.hypot(report["max_error_m"], 0.004))
    assert main(["simulate", shot, "--json", "--step", "0.01"]) == 0
    assert json.loads(capsys.readouterr().out)["calibration_error_m"] is None


def test_the_largest_torque_is_that_of_the_duty_cycle_and_of_the_drive_where_these_limit_it(tmp_path):
    def edit(stage):
        make_target(stage)
        joint = stage.GetPrimAtPath(SHOULDER)
        joint.AddAppliedSchema("CalmMotorAPI")
        for name, value in (("model", "servo"), ("type", "xl330-m288")):
            joint.CreateAttribute(f"calm:motor:{name}", Sdf.ValueTypeNames.Token).Set(value)
        for name, value in (("voltage", 7.4), ("dutyGain", 0.02)):
            set_float(stage, SHOULDER, f"calm:motor:{name}", value)

    def held(stage):
        edit(stage)
        for name in ("voltage", "dutyGain"):
            stage.GetPrimAtPath(SHOULDER).RemoveProperty(f"calm:motor:{name}")
        set_float(stage, SHOULDER, "calm:motor:positionGain", 0.01)
        set_float(stage, SHOULDER, "drive:angular:physics:maxForce", 0.7)

    for k, author in enumerate((edit, held)):
        shot = str(write_arm(tmp_path / f"{k}.usda", author))
        character, _, provenance = read_shot(shot)
        own = character.motors[0]
        rows = (
            estimate("position_gain", SHOULDER, own.position_gain, 1.1 * own.position_gain),
            estimate("max_torque", SHOULDER, own.max_torque, 1.3 * own.max_torque),
        )
        _, root = write_calibration(character, provenance, calibration_of(*rows), str(tmp_path / f"robot{k}.usda"))
        found = read_shot(root)[0].motors[0]
        assert found.max_torque == pytest.approx(1.3 * own.max_torque, rel=1e-5)
        assert found.position_gain == pytest.approx(1.1 * own.position_gain, rel=1e-5)


def told_of(shot, folder, **parts):
    character, _, provenance = read_shot(shot)
    calibration = dataclasses.replace(calibration_of(estimate("modulus", PLASTIC, 2e9, 2.3e9, 2e7)), **parts)
    _, root = write_calibration(character, provenance, calibration, str(folder / "robot.usda"))
    return [note for note in read_shot(root)[0].notes if "the calibrated model" in note], character


def test_a_shot_tells_how_far_its_calibration_was_from_an_encoder_at_the_farthest_target(shot, tmp_path):
    fit = ChannelFit("take.csv", f"angle {ELBOW}", "rad", 90, 10, 1e-3, 0.1, 0.01, 0.02, 0, 0.05)
    (note,), character = told_of(shot, tmp_path, channels=(fit,))
    ends = [
        place.position + Rotation.from_quat(np.roll(place.rotation, -1)).apply(at.position)
        for joint in character.joints if joint.path == ELBOW
        for place, at in [(character.bodies[joint.body1].rest, joint.frame1)]
        + [(character.bodies[target.body].rest, target.frame) for target in character.targets]
    ]  # fmt: skip
    arm = max(np.linalg.norm(end - ends[0]) for end in ends[1:])
    assert f"by {20 * arm:.3g} mm (root mean square), {50 * arm:.3g} mm at most; expect at least that" in note


def test_a_shot_tells_which_share_of_the_shake_its_calibration_left(shot, tmp_path):
    shares = (("angle", ELBOW, 0.07), ("strain", FORE, 0.12), ("accelerometer", FORE, float("nan")))
    fits = [
        ChannelFit("take.csv", f"{kind} {path}", "", 90, 10, 1e-3, 0.1, 0.01, 0.02, 0, 0.05, share)
        for kind, path, share in shares
    ]
    (note,), _ = told_of(shot, tmp_path, channels=tuple(fits))
    assert "left 12% of the shake in its recordings and differed from its recordings by" in note
    (note,), _ = told_of(shot, tmp_path, channels=tuple(fits[1:]))
    assert "left 12% of the shake in its recordings; expect" in note
    assert told_of(shot, tmp_path)[0] == []
