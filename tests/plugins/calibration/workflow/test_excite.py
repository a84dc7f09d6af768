"""`calmotion excite`: a layer that opens the shot with a test motion, and its report."""

import json

import numpy as np
import pytest
from calmotion.host import SettingError
from calmotion.usd.reading import read_shot
from calmotion_plugins.calibration.workflow.excite import sensor_of
from small_shots import HAND, PLASTIC, RATE, SHOULDER, make_flexible, make_target, write_arm


def moving(path):
    def edit(stage):
        make_flexible(stage, "/Arm/fore", youngsModulus=1e8)
        make_target(stage)
        for path in (SHOULDER, "/Arm/joints/elbow"):
            attribute = stage.GetPrimAtPath(path).GetAttribute("drive:angular:physics:targetPosition")
            attribute.Clear()
            for frame in range(25):
                attribute.Set(10.0 + 20.0 * float(np.sin(0.05 * frame) ** 2), frame)

    return write_arm(path, edit)


def test_the_layer_is_a_shot_with_the_motion(calmotion, tmp_path):
    shot = moving(tmp_path / "shot.usda")
    done = calmotion(
        "excite", shot, "-o", tmp_path / "test.usda", "--sensor", f"marker@{HAND}=0.2mm", "--sensor", "angle",
        "--parameters", "modulus", "damping", "--duration", "1.5s", "--tries", "2", "--json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert [row["path"] for row in report["parameters"]] == [PLASTIC, PLASTIC]
    for row in report["parameters"]:
        assert 0.0 < row["standard_deviation"] < row["prior"]["standard_deviation"] * 1.0001
    assert {(row["kind"], row["sigma"]) for row in report["sensors"]} == {("marker", 2e-4), ("angle", 3e-4)}
    character, animation, _ = read_shot(str(tmp_path / "test.usda"))
    assert animation.frame_times[-1] == pytest.approx(1.5, abs=1 / RATE) == report["duration_s"]
    for track, use in zip(animation.tracks, report["motors"], strict=True):
        assert np.degrees(track.values[0]) == pytest.approx(10.0, abs=1e-4) == np.degrees(track.values[-1])
        assert np.abs(track.values - track.values[0]).max() == pytest.approx(use["excursion"], abs=1e-5)
        assert use["excursion"] <= np.radians(10.0) and use["velocity_share"] <= 1.0


def test_sensors_are_named_by_kind_prim_and_noise():
    assert sensor_of("effort").path == "" and sensor_of("accelerometer@/A/b=0.2").sigma == 0.2
    assert sensor_of("marker=0.5mm").sigma == pytest.approx(5e-4)
    for text in ("gyro", "marker@hand", "marker=0", "angle=x"):
        with pytest.raises(SettingError):
            sensor_of(text)
