"""Commands for controllers, from a shot, from a written layer and from a result, with what they cost."""

import json

import calmotion as cm
import numpy as np
import pytest
import yaml
from calmotion_plugins.controller_export import export, write_curves
from one_hinge import HINGE, ONE_HINGE, TIP
from scipy.interpolate import CubicSpline

MOVING = "0: 0, 6: 10, 12: 30, 18: 20, 24: 0"


@pytest.fixture
def shot_file(tmp_path):
    path = tmp_path / "shot.usda"
    path.write_text(ONE_HINGE)
    return path


def positions(path):
    with open(path) as file:
        return np.array([point["positions"] for point in yaml.safe_load(file)["points"]])


def test_the_loss_of_lines_is_the_distance_from_the_curve(shot_file, tmp_path):
    made = export(shot_file, tmp_path / "a.csv", to="csv", rate=30)
    track, times = cm.open_shot(shot_file).animation.tracks[0], np.linspace(0.0, 1.0, 3001)
    curve, sent = CubicSpline(track.times, track.values), np.arange(31) / 30
    off = np.abs(np.interp(times, sent, curve(sent)) - curve(times)).max()
    # the tip is a tenth of a metre from the hinge
    assert made.loss_m[TIP] == pytest.approx(0.1 * off, rel=0.03)
    assert made.rate == 30 and made.loss_kept == (made.loss_m[TIP] <= made.allowed_loss)


@pytest.mark.parametrize("lengths", [{"tolerance": "0.1mm"}, {"tolerance": "2mm", "allowed_loss": "0.1mm"}])
def test_the_lowest_rate_keeps_the_allowed_loss_and_the_next_lower_does_not(shot_file, tmp_path, lengths):
    made = export(shot_file, tmp_path / "a.csv", to="csv", rate=30, **lengths)
    losses = [
        export(shot_file, tmp_path / "b.csv", to="csv", rate=rate, search=False, **lengths).loss_m[TIP]
        for rate in (made.lowest_rate - 1, made.lowest_rate)
    ]
    assert losses[1] <= 1e-4 < losses[0]
    assert made.simulations <= 14


def test_rounding_and_a_late_start_have_columns_of_their_own(shot_file, tmp_path):
    (tmp_path / "servos.toml").write_text("[default]\nresolution = 360\n[Hinge]\n")
    chosen = {"export.ticks.motors": str(tmp_path / "servos.toml")}
    made = export(shot_file, tmp_path / "a.json", to="ticks", rate=200, start_delay="5ms", settings=chosen)
    (row,) = made.report()["targets"]
    # a tick is a degree: half of it at a tenth of a metre
    assert row["rounding_loss_m"] == pytest.approx(0.1 * np.radians(0.5), rel=0.3)
    assert row["start_loss_m"] == pytest.approx(0.005 * row["delay_cost_m_per_s"], rel=0.5)
    assert made.lowest_rate is None, "no rate makes up for coarse ticks"
    assert row["loss_m"] > made.allowed_loss and not made.loss_kept


HEAD = """#usda 1.0
(
    customLayerData = { dictionary calmotion = { string role = "ROLE" } }
    endTimeCode = 24
    metersPerUnit = 1
    startTimeCode = 0
    timeCodesPerSecond = 24
    upAxis = "Z"
    SUBLAYERS
)
"""


def test_a_layer_of_results_is_opened_with_its_shot(shot_file, tmp_path, calmotion):
    new = MOVING.replace("30", "35")
    (tmp_path / "calm.usda").write_text(
        HEAD.replace("ROLE", "curves").replace("SUBLAYERS", "") + 'over "Robot" {\n over "Hinge" {\n'
        f"float drive:angular:physics:targetPosition.timeSamples = {{ {new} }}\n }}\n}}\n"
    )
    below = "subLayers = [@./calm.usda@, @./shot.usda@]"
    (tmp_path / "calm_root.usda").write_text(HEAD.replace("ROLE", "root").replace("SUBLAYERS", below))
    done = calmotion("export", tmp_path / "calm.usda", "--to", "ros2", "--rate", "20", "-o", tmp_path / "a.yaml")
    assert done.returncode == 0, done.stderr
    np.testing.assert_allclose(positions(tmp_path / "a.yaml")[10, 0], np.radians(35.0), atol=1e-6)


def test_a_result_is_exported_without_another_run(shot_file, tmp_path):
    result = cm.simulate(shot_file, step="4ms")
    ran = []
    made = export(result, tmp_path / "a.yaml", to="ros2", rate=50, on_operator=ran.append, search=False)
    assert not ran and made.motors == {HINGE: "Hinge"}
    np.testing.assert_allclose(positions(made.files[0])[25, 0], result.motors[HINGE].output[len(result.times) // 2])


def test_the_command_prints_what_the_interface_reports(shot_file, tmp_path, calmotion, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = calmotion("export", shot_file, "--to", "ros2", "--rate", "50", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["files"] == ["shot.yaml"] and (tmp_path / "shot.yaml").is_file()
    assert report["loss_m"].keys() == {TIP} and report["lowest_rate_hz"] >= 1 and report["tolerance_kept"] is True
    table = calmotion("export", shot_file, "--to", "csv", "--rate", "4", "-o", "b.csv", "--strict")
    assert table.returncode == 1 and "more than the allowed" in table.stdout and "lowest rate" in table.stdout
    assert calmotion("export", shot_file, "--to", "csv", "--quiet").stdout == ""


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--to", "ros"], "Did you mean ros2?"), (["--to", "csv", "--rate", "0"], "1 to 100000"),
        (["--to", "ticks"], "no servos are named"), (["--to", "csv", "-o", "."], "cannot be written"),
        (["--to", "csv", "--rate", "5kg"], "5kg"),
    ],
)  # fmt: skip
def test_wrong_options_are_refused_before_the_robot_is_simulated(shot_file, calmotion, arguments, told):
    done = calmotion("export", shot_file, *arguments)
    assert done.returncode in (1, 2) and told in done.stderr and "Simulate" not in done.stderr


def test_a_shot_without_motors_is_refused(shot_file, tmp_path):
    shot_file.write_text(ONE_HINGE.replace('"PhysicsDriveAPI:angular"', '"PhysicsDriveAPI:linear"'))
    with pytest.raises(cm.ShotError):
        export(shot_file, tmp_path / "a.csv", to="csv")


def test_no_output_of_a_result_is_written_over_its_shot_or_a_layer_of_it(shot_file, tmp_path):
    result = cm.simulate(shot_file, step="10ms", tolerance="1mm")
    with pytest.raises(cm.SettingError, match="never overwritten"):
        write_curves(result, shot_file)
    for write in (result.write_table, result.record, result.film):
        with pytest.raises(cm.SettingError, match="never overwritten"):
            write(shot_file)
    assert shot_file.read_text() == ONE_HINGE


def test_the_curves_of_a_result_are_written_at_a_rate(shot_file, tmp_path):
    result = cm.simulate(shot_file, step="10ms", tolerance="1mm")
    file = write_curves(result, tmp_path / "a.csv", rate=50, settings={"export.csv.angles": "deg"})
    with open(file) as stream:
        rows = [line.split(",") for line in stream if not line.startswith("#")]
    assert len(rows) == 1 + 51
    assert float(rows[26][1]) == pytest.approx(np.degrees(result.motors[HINGE].output[len(result.times) // 2]))


def test_a_motor_that_is_switched_off_is_told(shot_file, tmp_path):
    servo = """uniform token calm:motor:model = "servo"
        uniform float calm:motor:positionGain = 0.5
        uniform float calm:motor:velocityGain = 0.05
        uniform float calm:motor:armature = 0.01
        bool calm:motor:powered.timeSamples = { 0: true, 12: false }
        uniform token physics:axis"""
    text = ONE_HINGE.replace('Hinge" (prepend apiSchemas = [', 'Hinge" (prepend apiSchemas = ["CalmMotorAPI", ')
    shot_file.write_text(text.replace("uniform token physics:axis", servo))
    made = export(shot_file, tmp_path / "a.csv", to="csv", rate=100, search=False)
    assert any(f"calm:motor:powered switches {HINGE} off and on" in note for note in made.notes)
