"""The Python interface on a small robot in USD: arrays by prim path, report, files, cancelling."""

import csv
import json
import threading

import calmotion as cm
import numpy as np
import pytest
from calmotion.model.model_choice import KINDS, OFF, ON
from calmotion.workflow.commands import _forced
from one_hinge import HINGE, ONE_HINGE, TIP
from scipy.interpolate import CubicSpline


@pytest.fixture
def shot_file(tmp_path):
    path = tmp_path / "shot.usda"
    path.write_text(ONE_HINGE)
    return path


@pytest.fixture
def simulated(shot_file):
    return cm.simulate(cm.open_shot(shot_file), step="4ms")


def test_an_opened_shot_lists_its_content(shot_file):
    shot = cm.open_shot(shot_file)
    assert shot.targets == (TIP,) and shot.motors == (HINGE,)
    assert shot.animation.frame_times[-1] == pytest.approx(1.0)
    assert shot.provenance.shot == str(shot_file)


def test_a_shot_that_cannot_be_read_raises_with_the_place(tmp_path):
    (tmp_path / "no.usda").write_text(ONE_HINGE.replace('"PhysicsDriveAPI:angular"', ""))
    with pytest.raises(cm.ShotError) as raised:
        cm.open_shot(tmp_path / "no.usda")
    assert raised.value.problem and raised.value.problems[0].operator == "usd.read"
    with pytest.raises(cm.ShotError, match="missing.usda"):
        cm.open_shot(tmp_path / "missing.usda")


def test_results_are_arrays_by_prim_path(simulated):
    tip, hinge = simulated.targets[TIP], simulated.motors[HINGE]
    steps = len(simulated.times)
    assert simulated.times[0] == pytest.approx(0.0, abs=1e-9) and simulated.times[-1] == pytest.approx(1.0)
    assert tip.position.shape == (steps, 3) and tip.orientation.shape == (steps, 4) and tip.error.shape == (steps,)
    assert np.interp(0.5, simulated.times, hinge.input) == pytest.approx(np.radians(30), rel=1e-6)
    # the tip goes round the hinge with the motor
    np.testing.assert_allclose(np.arctan2(tip.position[:, 1], tip.position[:, 0]), hinge.output, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(tip.position - tip.intended_position, axis=1), tip.error, atol=1e-12)
    assert simulated.max_error == tip.max_error and simulated.rms_error == pytest.approx(tip.rms_error)


@pytest.mark.parametrize(
    ("first", "last", "angles"),
    [
        (6, 18, (10.0, 20.0)), (6.5, 17.25, None), (-12, 36, (0.0, 0.0)), (12, 13, (30.0, None)),
        (-48, -24, (0.0, 0.0)), (48, 72, (0.0, 0.0)),
    ],
)  # fmt: skip
def test_a_range_within_beyond_or_beside_the_samples_is_simulated(shot_file, first, last, angles):
    shot_file.write_text(ONE_HINGE.replace("endTimeCode = 24", f"endTimeCode = {last}").replace(
        "startTimeCode = 0", f"startTimeCode = {first}"
    ))  # fmt: skip
    motion = cm.simulate(cm.open_shot(shot_file), step="4ms").motion
    assert motion.times[0] == pytest.approx(0.0, abs=1e-9)
    assert motion.times[-1] == pytest.approx((last - first) / 24, abs=1 / 24)
    found = np.degrees(motion.motors[HINGE].output)
    for value, expected in zip((found[0], found[-1]), angles or (), strict=False):
        assert expected is None or value == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(("first", "last"), [(0, 0), (24, 0), (7, 7), (3, 3.5)])
def test_a_range_without_two_frames_is_refused_with_what_to_author(shot_file, first, last):
    shot_file.write_text(ONE_HINGE.replace("endTimeCode = 24", f"endTimeCode = {last}").replace(
        "startTimeCode = 0", f"startTimeCode = {first}"
    ))  # fmt: skip
    with pytest.raises(cm.ShotError) as refused:
        cm.simulate(cm.open_shot(shot_file), step="4ms")
    assert refused.value.attribute == "endTimeCode" and "startTimeCode" in refused.value.remedy


def test_the_report_is_the_object_of_the_command_line(shot_file, simulated, calmotion):
    printed = json.loads(calmotion("simulate", shot_file, "--step", "4ms", "--json").stdout)
    report = simulated.report()
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert set(report) == set(printed)
    for key in ("targets", "steps", "step_s", "dof", "command", "version", "max_error_m"):
        assert report[key] == printed[key]


def test_an_opened_shot_is_not_read_again(shot_file):
    shot = cm.open_shot(shot_file)
    ran = []
    cm.simulate(shot, step=0.004, on_operator=ran.append)
    assert "usd.read" not in [operator.idname for operator in ran]
    assert "retarget.simulate" in [operator.idname for operator in ran]
    ran.clear()
    cm.simulate(shot_file, step=0.004, on_operator=ran.append)
    assert "usd.read" in [operator.idname for operator in ran]


def test_files_are_made_of_a_result(simulated, tmp_path):
    table = simulated.write_table(tmp_path / "table.csv")
    with open(table, newline="") as stream:
        rows = list(csv.reader(stream))
    assert rows[0] == list(simulated.columns()) and len(rows) == len(simulated.times) + 1
    written = simulated.write(tmp_path / "layer.usda", bake="motors")
    assert (tmp_path / "layer.usda").is_file() and cm.open_shot(written.root).targets == (TIP,)


def test_a_layer_of_the_shot_is_never_written(simulated, shot_file):
    before = shot_file.read_bytes()
    with pytest.raises(cm.ShotError):
        simulated.write(shot_file)
    with pytest.raises(cm.SettingError):
        cm.simulate(shot_file, outputs=cm.OutputPaths(layer=str(shot_file)))
    assert shot_file.read_bytes() == before


def test_the_table_has_the_columns_by_name(simulated):
    table = simulated.table()
    np.testing.assert_array_equal(np.asarray(table[f"{TIP}.error"]), simulated.targets[TIP].error)
    np.testing.assert_array_equal(np.asarray(table["time_s"]), simulated.times)


def test_optimize_has_the_motion_before_and_after(shot_file):
    result = cm.optimize(shot_file, step="8ms")
    assert isinstance(result, cm.OptimizationResult) and result.stopped
    assert result.before.targets[TIP].position.shape == result.targets[TIP].position.shape
    assert result.rms_error <= result.before.targets[TIP].rms_error + 1e-12
    assert result.report()["command"] == "optimize"


def test_a_result_can_be_verified(simulated):
    verification = cm.verify(simulated)
    assert verification.step_s < simulated.report()["step_s"] and verification.error_m >= 0.0


def test_progress_has_stage_fraction_and_time_left(shot_file):
    seen = []
    cm.simulate(shot_file, step="4ms", progress=seen.append)
    assert {state.stage for state in seen} >= {"Read the shot", "Simulate the shot"}
    assert all(0.0 <= state.fraction <= 1.0 for state in seen)
    assert all(state.time_left_s is None or state.time_left_s >= 0.0 for state in seen)


WRONG_MOTIONS = {
    "robot.urdf": ('<?xml version="1.0"?><robot name="r"/>', "This is a URDF robot"),
    "robot.xml": ('<mujoco model="m"/>', "This is an MJCF robot"),
    "notes.txt": ("hello", "Name a .csv, .npz or .bvh file"),
}


@pytest.mark.parametrize("name", WRONG_MOTIONS)
def test_a_motion_of_a_wrong_kind_is_refused_with_what_to_do(calmotion, shot_file, tmp_path, name):
    text, remedy = WRONG_MOTIONS[name]
    (tmp_path / name).write_text(text)
    done = calmotion("simulate", shot_file, "--motion", tmp_path / name)
    assert done.returncode == 2 and "no plugin reads this motion" in done.stderr
    assert remedy in done.stderr and name in done.stderr and "done in" not in done.stderr


def test_a_table_of_joint_angles_moves_the_robot(calmotion, shot_file, tmp_path):
    (tmp_path / "wave.csv").write_text("time_s,Hinge\n0,0\n0.5,0.4\n1,0.1\n")
    done = calmotion("simulate", shot_file, "--motion", tmp_path / "wave.csv", "--csv", tmp_path / "out.csv")
    assert done.returncode == 0, done.stderr
    rows = np.genfromtxt(tmp_path / "out.csv", delimiter=",", names=True, deletechars="")
    assert np.interp(0.5, rows["time_s"], rows[f"{HINGE}.output"]) == pytest.approx(0.4, abs=1e-6)


def test_a_cancelled_run_raises(shot_file):
    stop = threading.Event()

    def progress(state):
        if state.stage == "Simulate the shot":
            stop.set()

    with pytest.raises(cm.Cancelled, match="shot.usda"):
        cm.simulate(shot_file, step="4ms", progress=progress, cancel=stop.is_set)


@pytest.mark.parametrize("hook", ["progress", "cancel", "on_operator"])
@pytest.mark.parametrize("error", [ValueError, SystemExit])
def test_what_a_callback_raises_reaches_its_owner(shot_file, tmp_path, hook, error):
    calls = []

    def wrong(*told):
        calls.append(told)
        raise error("the panel is closed")

    with pytest.raises(error, match="the panel is closed"):
        cm.optimize(shot_file, outputs=cm.OutputPaths(layer=tmp_path / "calm.usda"), **{hook: wrong})
    assert len(calls) == 1 and not list(tmp_path.glob("calm*"))


def test_an_inspection_reports_what_is_there(shot_file):
    report = cm.inspect(shot_file).report()
    assert report["motors"][0]["path"] == HINGE and report["targets"][0]["path"] == TIP
    checked = cm.inspect(shot_file, strict=True)
    assert checked.findings is not None and checked.report()["findings"] == []


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ({"tolerance": "1kg"}, "1kg"), ({"settings": {"no.such.thing": 1}}, "no.such"), ({"tolerance": "1"}, "1mm"),
        ({"pre_roll": float("inf")}, "finite"), ({"integrator": 5}, "bdf2"), ({"shaper": 5}, "zvd"),
        ({"outputs": {"layer": "calm.usda"}}, "OutputPaths"), ({"operators": "no.such"}, "no.such"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_setting_errors(shot_file, given, problem):
    with pytest.raises(cm.SettingError, match=problem):
        cm.simulate(shot_file, **given)


def test_keep_wins_over_leave_out():
    assert _forced([], []) == {}
    assert _forced(["modes"], ["all"]) == {"accuracy.analyse": dict.fromkeys(KINDS, OFF) | {"modes": ON}}


def test_motors_that_give_are_simulated_unless_ideal_ones_are_asked_for(tmp_path):
    """A drive of half a newton metre per degree; inspect knows what it does before."""
    text = ONE_HINGE.replace('"PhysicsDriveAPI:angular"', '"PhysicsDriveAPI:angular", "CalmMotorAPI"')
    at = text.index("float drive:angular:physics:targetPosition")
    gains = (
        'uniform token calm:motor:model = "{}"\n'
        "float calm:motor:positionGain = 0.5\n"
        "float calm:motor:velocityGain = 0.02\n"
    )
    for model in ("drive", "prescribed"):
        (tmp_path / f"{model}.usda").write_text(text[:at] + gains.format(model) + text[at:])
    gives = cm.simulate(tmp_path / "drive.usda", step="4ms")
    assert gives.max_error > 5e-4
    (shares,) = gives.report()["error_shares"]
    assert shares["path"] == TIP and shares["motors_m"] == pytest.approx(gives.max_error, rel=0.01)
    ideal = cm.simulate(tmp_path / "drive.usda", step="4ms", motors="ideal")
    assert ideal.max_error < 1e-6 and ideal.report()["error_shares"] == []
    report = cm.inspect(tmp_path / "prescribed.usda", step="4ms").report()
    (effect,) = report["effects_of_gains"]
    assert effect["max_error_m"] == pytest.approx(gives.max_error, rel=0.05)
    (motor,) = report["motors"]
    assert motor["model"] == "prescribed" and motor["position_gain_n_m_rad"] == pytest.approx(np.degrees(0.5))
    with pytest.raises(cm.SettingError, match="motors is 'perfect'"):
        cm.simulate(tmp_path / "drive.usda", motors="perfect")


@pytest.mark.parametrize("share", [0.5, 1.1])
@pytest.mark.parametrize(
    ("attribute", "quantity", "order", "unit"),
    [
        ("maxVelocity", "velocity", 1, 1.0), ("maxAcceleration", "acceleration", 2, 1.0),
        ("maxJerk", "jerk", 3, 1.0), ("maxTorque", "effort", 2, np.radians(1.0) * 2 * 0.2**2 / 6),
    ],
)  # fmt: skip
def test_inspect_finds_animations_beyond_the_limits_of_motors(tmp_path, attribute, quantity, order, unit, share):
    """Each limit by itself, above or below what the cubic through the samples needs; the effort is inertia times it."""
    spline = CubicSpline(np.linspace(0.0, 1.0, 5), [0, 10, 30, 20, 0])
    peak = np.abs(spline(np.linspace(0.0, 1.0, 4801), order)).max() * unit
    text = ONE_HINGE.replace('"PhysicsDriveAPI:angular"', '"PhysicsDriveAPI:angular", "CalmMotorAPI"')
    text = text.replace(
        "rel physics:body1", f"float calm:motor:{attribute} = {share * peak:.9g}\n        rel physics:body1"
    )
    (tmp_path / "shot.usda").write_text(text)
    report = cm.inspect(tmp_path / "shot.usda").report()
    rows, tempo = report["limits"], report["tempo"]
    findings = cm.inspect(tmp_path / "shot.usda", strict=True).findings.items
    found = [finding for finding in findings if quantity in finding.problem]
    assert len(rows) == len(found) == (share < 1.0)
    if rows:
        assert rows[0]["quantity"] == quantity and rows[0]["exceeded"]
        assert abs(rows[0]["before"]) == pytest.approx(peak if quantity == "effort" else np.radians(peak), rel=0.02)
        assert found[0].path == HINGE and found[0].attribute == f"calm:motor:{attribute}" and found[0].remedy
        assert tempo["possible"] and tempo["uniform_stretch"] == pytest.approx(share ** (-1 / order), rel=0.02)
        assert 0.0 <= tempo["least_added_s"] < tempo["uniform_added_s"]
    else:
        assert tempo is None


def test_inspect_names_the_motor_that_no_tempo_helps(tmp_path, calmotion):
    """A hinge that lifts: the weight of its link, at its middle, needs more than the motor has."""
    text = ONE_HINGE.replace('"PhysicsDriveAPI:angular"', '"PhysicsDriveAPI:angular", "CalmMotorAPI"')
    text = text.replace("rel physics:body1", "float calm:motor:maxTorque = 1.5\n        rel physics:body1")
    text = text.replace("physics:mass = 2", "physics:mass = 2\n        point3f physics:centerOfMass = (0.1, 0, 0)")
    shot = tmp_path / "shot.usda"
    shot.write_text(text + 'def PhysicsScene "Physics" {\n vector3f physics:gravityDirection = (0, -1, 0)\n'
                    " float physics:gravityMagnitude = 9.81\n}\n")  # fmt: skip
    tempo = cm.inspect(shot).report()["tempo"]
    assert not tempo["possible"]
    assert tempo["too_weak"]["path"] == HINGE and tempo["too_weak"]["limit"] == pytest.approx(1.5)
    assert tempo["too_weak"]["needed"] == pytest.approx(2.0 * 9.81 * 0.1, rel=1e-3)
    ended = calmotion("optimize", shot, "-o", tmp_path / "calm.usda", "--retime", "--step", "4ms")
    assert ended.returncode != 0 and "no tempo helps" in ended.stderr and HINGE in ended.stderr


def test_inspecting_a_robot_with_gains_and_without_animation_is_no_problem(tmp_path):
    samples = ".timeSamples = { 0: 0, 6: 10, 12: 30, 18: 20, 24: 0 }"
    still = ONE_HINGE.replace(samples, " = 0\n        float drive:angular:physics:stiffness = 5")
    (tmp_path / "still.usda").write_text(still.replace("endTimeCode = 24", "endTimeCode = 0"))
    inspection = cm.inspect(tmp_path / "still.usda")
    assert inspection.problems == () and inspection.report()["effects_of_gains"] == []
    assert inspection.report()["motors"][0]["gains_from"] == "drive:angular:physics:stiffness (UsdPhysics)"


@pytest.mark.parametrize("value", [True, [1e-3], np.array([1e-3, 2e-3]), b"1mm"])
def test_a_tolerance_that_is_no_quantity_is_an_error_of_the_caller(tmp_path, value):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    with pytest.raises(cm.SettingError, match="must be a number or a text"):
        cm.simulate(tmp_path / "shot.usda", tolerance=value)


def test_one_kind_of_simplification_may_be_named_by_itself():
    assert _forced("modes", ()) == _forced(["modes"], ()) and _forced((), "modes") == _forced((), ["modes"])


def test_arrays_of_a_result_cannot_be_changed_by_mistake(simulated):
    (target,), (motor, *_) = simulated.targets.values(), simulated.motors.values()
    for array in (simulated.times, target.error, target.position, motor.output):
        with pytest.raises(ValueError, match="read-only"):
            array *= 1e3
