"""Animations that exceed the limits of their motors by far end in curves that keep them, as near as they allow."""

import json

import numpy as np
import pytest
from calmotion.model.curves import held_curve
from calmotion.usd.reading import read_shot
from one_hinge import HINGE, ONE_HINGE
from scipy.optimize import lsq_linear

LEVER = 0.1  # of the target [m]
MOTOR = '"PhysicsDriveAPI:angular", "CalmMotorAPI"]'


def hinge(folder, *attributes):
    """The hinge, which moves at up to 100 deg/s, with limits of its motor."""
    text = ONE_HINGE.replace('"PhysicsDriveAPI:angular"]', MOTOR)
    shot = folder / "shot.usda"
    shot.write_text(text.replace("        rel physics:body1", "\n".join((*attributes, "        rel physics:body1"))))
    return shot


def optimized(calmotion, shot):
    done = calmotion("optimize", shot, "-o", shot.parent / "out.usda", "--json", "--quiet")
    assert done.returncode == 0, done.stdout
    report = json.loads(done.stdout)
    return report, {use["quantity"]: use for use in report["limits"]}


def rms(report):
    return report["rms_error_after_m"]


def nearest(shot, speed):
    """Root-mean-square error [m] of the nearest of all motions that are no faster [rad/s]: a bounded least-squares
    problem in the speeds."""
    _, animation, _ = read_shot(str(shot))
    times = np.linspace(0.0, 1.0, 241)
    wanted = held_curve(animation.tracks[0], 1.0)(times, 0)
    sums = np.c_[np.ones(241), np.r_[np.zeros((1, 240)), np.tril(np.full((240, 240), times[1]))]]
    bounds = np.r_[-np.inf, np.full(240, -speed)], np.r_[np.inf, np.full(240, speed)]
    return LEVER * np.sqrt(np.mean((sums @ lsq_linear(sums, wanted, bounds).x - wanted) ** 2))


@pytest.mark.parametrize("limit", [80.0, 45.0])
def test_a_limit_of_speed_is_kept_by_the_nearest_curves(calmotion, tmp_path, limit):
    shot = hinge(tmp_path, f"float calm:motor:maxVelocity = {limit}")
    report, uses = optimized(calmotion, shot)
    use = uses["velocity"]
    assert np.degrees(use["before"]) == pytest.approx(100.3, abs=0.1)
    assert not use["exceeded"] and np.degrees(use["after"]) == pytest.approx(limit, rel=1e-3)
    bound = nearest(shot, np.radians(limit))
    assert 0.98 * bound < rms(report) < 1.1 * bound
    assert use["cost_m"] > 0.5 * rms(report)


def test_limits_of_speed_and_acceleration_are_kept_together(calmotion, tmp_path):
    shot = hinge(tmp_path, "float calm:motor:maxVelocity = 45", "float calm:motor:maxAcceleration = 250")
    report, uses = optimized(calmotion, shot)
    assert not uses["velocity"]["exceeded"] and not uses["acceleration"]["exceeded"]
    assert np.degrees(abs(uses["acceleration"]["after"])) == pytest.approx(250.0, rel=1e-3)
    assert rms(report) < 0.012


@pytest.mark.long
@pytest.mark.parametrize("share", [0.83, 0.5, 0.2])
def test_a_limit_of_torque_that_the_animation_exceeds_to_its_end_is_kept(calmotion, tmp_path, share):
    shot = hinge(tmp_path, f"float calm:motor:maxTorque = {0.2569 * share:.6f}")
    report, uses = optimized(calmotion, shot)
    assert uses["effort"]["before"] == pytest.approx(0.2569, rel=1e-3) and not uses["effort"]["exceeded"]
    assert rms(report) < 0.02


def test_where_curves_are_locked_the_limit_is_exceeded_as_little_as_they_allow(calmotion, tmp_path):
    shot = hinge(
        tmp_path, "float calm:motor:maxVelocity = 45",
        "bool calm:motor:optimize.timeSamples = { 0: 1, 8: 0, 14: 1 }",
    )  # fmt: skip
    report, uses = optimized(calmotion, shot)
    use = uses["velocity"]
    assert use["path"] == HINGE and use["exceeded"] and 80.0 < np.degrees(abs(use["after"])) < 100.0
    assert rms(report) < 0.01 and report["stopped"] != "iteration limit"
