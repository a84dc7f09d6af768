"""What else works with a performance at another tempo, or says that it does not."""

import json
from functools import partial

import calmotion as cm
import numpy as np
import pytest
import small_shots as shots
from calmotion.workflow.commands import optimize
from calmotion.workflow.shot import Shot
from calmotion.workflow.watch import Watch
from pxr import Sdf
from steppers import giving, write_stepper

SPEED = 120.0  # of both motors [deg/s]; the shoulder needs 126, the elbow 189
OPTIONS = {"step": "4ms", "tolerance": "5mm", "retime": {"slowest": 3.0}}


def slow(stage):
    """Motors that are too slow for the animation, and a hand that counts."""
    shots.make_target(stage)
    for joint in (shots.SHOULDER, shots.ELBOW):
        stage.GetPrimAtPath(joint).AddAppliedSchema("CalmMotorAPI")
        shots.set_float(stage, joint, "calm:motor:maxVelocity", SPEED)


def slow_and_compliant(stage):
    slow(stage)
    for joint in (shots.SHOULDER, shots.ELBOW):
        prim = stage.GetPrimAtPath(joint)
        prim.CreateAttribute("calm:motor:model", Sdf.ValueTypeNames.Token, False).Set("drive")
        shots.set_float(stage, joint, "calm:motor:positionGain", 30.0)
        shots.set_float(stage, joint, "calm:motor:velocityGain", 0.6)


def commands_in(table):
    """Times and commands [s, rad]."""
    lines = [line for line in table.read_text().splitlines() if line[0] in "-0123456789"]
    return np.loadtxt(lines, delimiter=",")


def fastest(table):
    """Largest speed of the commands of a table [deg/s]."""
    rows = commands_in(table)
    return np.degrees(np.abs(np.diff(rows[:, 1:], axis=0)).max()) / (rows[1, 0] - rows[0, 0])


def test_commands_of_a_retimed_shot_are_exported_at_its_tempo_and_within_its_limits(tmp_path, calmotion):
    shot = shots.write_arm(tmp_path / "arm.usda", slow)
    result = cm.optimize(shot, outputs=cm.OutputPaths(layer=str(tmp_path / "calm.usda")), **OPTIONS)
    added = result.report()["retime"]["added_s"]
    assert added > 0.2
    ended = calmotion("export", tmp_path / "calm_root.usda", "--to", "csv", "-o", tmp_path / "out.csv", "--no-search")
    assert ended.returncode == 0, ended.stderr
    rows = commands_in(tmp_path / "out.csv")
    assert rows[-1, 0] == pytest.approx(1.0 + added, abs=0.011)
    assert fastest(tmp_path / "out.csv") <= 1.001 * SPEED
    # simulated as it is, and not retimed twice
    assert cm.simulate(tmp_path / "calm_root.usda", step="4ms").times[-1] == pytest.approx(1.0 + added)
    with pytest.raises(cm.ShotError, match="results at another tempo already"):
        cm.optimize(tmp_path / "calm_root.usda", **OPTIONS)


def test_motors_that_give_are_retimed_by_their_commands(tmp_path):
    result = cm.optimize(shots.write_arm(tmp_path / "arm.usda", slow_and_compliant), **OPTIONS)
    report = result.report()
    assert report["retime"]["added_s"] >= report["retime"]["lower_bound_s"] > 0.1
    assert not any(row["exceeded"] for row in report["limits"]) and result.max_error < 5e-3


def test_feet_come_and_go_at_the_tempo_of_the_performance(tmp_path):
    """A step with hips that may turn 20 degrees a second, where some turn a quarter faster."""

    def slow_hips(stage):
        giving(stage)
        for prim in stage.Traverse():
            if prim.GetTypeName() == "PhysicsRevoluteJoint":
                prim.AddAppliedSchema("CalmMotorAPI")
                shots.set_float(stage, str(prim.GetPath()), "calm:motor:maxVelocity", 20.0)

    result = cm.optimize(
        write_stepper(tmp_path / "stepper.usda", slow_hips), step=1 / 96, tolerance="1mm", retime={"slowest": 3.0}
    )
    report = result.report()
    assert 0.0 < report["retime"]["lower_bound_s"] < report["retime"]["added_s"] < 0.1
    assert result.max_error < 1e-3 and not any(row["exceeded"] for row in report["limits"])
    landed = [row["landing_speed_m_s"] for row in report["contacts"] if row["landing_speed_m_s"] is not None]
    assert len(landed) == 1 and landed[0] < 0.1 and all(row["unlike_ground"] == [] for row in report["contacts"])


def test_a_batch_retimes_each_of_its_shots(tmp_path, calmotion):
    shots.write_arm(tmp_path / "arm.usda", slow)
    ended = calmotion(
        "batch", tmp_path / "arm.usda", "-o", tmp_path / "out", "--retime", "slowest=3", "--step", "4ms",
        "--tolerance", "5mm", "--json",
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    (row,) = json.loads(ended.stdout)["jobs"]
    layer = Sdf.Layer.FindOrOpen(row["layer"])
    pairs = np.array(layer.GetAttributeAtPath("/Arm.calm:retime:map").default)
    assert pairs[-1, 0] == pytest.approx(24.0) and pairs[-1, 1] > 24.0 + 4.0


def test_a_watched_shot_is_retimed_again(tmp_path):
    path = shots.write_arm(tmp_path / "arm.usda", slow)
    watch = Watch(Shot(path), partial(optimize, **OPTIONS))
    first = watch.run()
    text = path.read_text().replace(f"maxVelocity = {SPEED:g}", f"maxVelocity = {1.2 * SPEED:g}")
    path.write_text(text)
    assert watch.wait(600.0)
    second = watch.run()
    added = [run.report()["retime"]["added_s"] for run in (first, second)]
    assert added[0] > added[1] > 0.0
