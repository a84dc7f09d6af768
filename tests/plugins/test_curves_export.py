"""Motor curves for a controller."""

from __future__ import annotations

import csv
import dataclasses
import os

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.shot import InputLayer, MotorCurve, Provenance
from calmotion.shot.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.testing import host_with, run_operator, small_shot

PROVENANCE = Provenance("shots/arm.usda", (InputLayer("arm.usda", "0"),), 1.0, 1.0, "Z", 24.0, 24.0, 0.0, 24.0, "Arm")


@pytest.fixture(scope="module")
def shot():
    character, animation = small_shot()
    motors = (dataclasses.replace(character.motors[0], max_velocity=2.0, max_torque=8.0), character.motors[1])
    character = dataclasses.replace(character, motors=motors)
    return (
        character,
        animation,
        simulate_shot(compile_shot(character, animation, None), RunSettings(step=1 / 120), lambda *_: None),
    )


@pytest.fixture
def export(repository, shot, tmp_path):
    def run(result=None, **settings):
        character, animation, simulated = shot
        settings = {"file": str(tmp_path / "out" / "curves.csv")} | settings
        values = [character, animation, PROVENANCE, result or simulated]
        host = host_with(repository / "plugins" / "table_writer")
        (found,) = run_operator(host, "curves.export", values, {"curves.export": settings})
        return found

    return run


def read(path):
    with open(path, newline="") as file:
        lines = file.read().splitlines()
    comments = [line for line in lines if line.startswith("#")]
    head, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    return comments, head, np.array(rows, float)


def test_rows_come_at_the_rate_of_the_controller(export, shot):
    found = export(rate="200Hz")
    _, head, rows = read(found.path)
    character, animation, _ = shot
    assert head == ["time_s", *(motor.path for motor in character.motors)]
    assert found.rows == len(rows) == 201 and np.allclose(np.diff(rows[:, 0]), 1 / 200)
    at_frames = np.searchsorted(rows[:, 0], animation.frame_times[::3] - 1e-6)
    assert np.allclose(rows[at_frames, 1], animation.tracks[0].values[::3], atol=1e-2)
    assert rows[0, 1] == pytest.approx(animation.tracks[0].values[0])


def test_the_header_has_rate_units_and_limits(export):
    comments, _, _ = read(export(rate=250.0).path)
    assert comments[0] == "# shot: arm.usda" and comments[1] == "# rate_hz: 250" and "angle rad" in comments[2]
    assert "/Arm/Shoulder: velocity 2 rad/s, effort 8 N m" in comments[3]
    assert "/Arm/Elbow: lower -2 rad, upper 2 rad" in comments[4]


def test_angles_may_be_degrees(export):
    _, _, radians = read(export().path)
    comments, _, degrees = read(export(angles="deg").path)
    assert np.allclose(degrees[:, 1:], np.degrees(radians[:, 1:])) and "lower -114.59" in comments[4]


def test_optimised_curves_are_what_is_exported(export, shot):
    character, animation, simulated = shot
    frames = animation.frame_times
    curves = tuple(MotorCurve(k, True, frames, 0.1 * k + 0.0 * frames, 0.1) for k in range(2))
    result = dataclasses.replace(simulated, after=simulated.before, curves=curves)
    _, _, rows = read(export(result).path)
    assert np.allclose(rows[:, 1], 0.0, atol=1e-12) and np.allclose(rows[:, 2], 0.1)


def test_without_a_file_it_says_how_to_name_one(export):
    with pytest.raises(ShotError, match="no file is named") as refused:
        export(file="")
    assert "--set curves.export.file" in refused.value.remedy


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_folder_that_cannot_be_written_to_is_refused(export, tmp_path):
    (tmp_path / "shut").mkdir(mode=0o555)
    with pytest.raises(ShotError, match="cannot be written"):
        export(file=str(tmp_path / "shut" / "curves.csv"))


def test_a_file_where_a_folder_should_be_is_refused_and_nothing_is_left(export, tmp_path):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(ShotError, match="cannot be written"):
        export(file=str(tmp_path / "taken" / "curves.csv"))
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]
