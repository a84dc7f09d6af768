import csv
import importlib.util
import stat

import numpy as np
import pytest
import synthetic
from calmotion.errors import ShotError
from calmotion.model.run import OutputPaths
from calmotion.testing import host_with, run_operator


@pytest.fixture
def host(repository):
    return host_with(repository / "plugins" / "table_writer")


def written(host, path, result):
    run_operator(host, "table.write", [synthetic.character(), result, OutputPaths(csv=str(path))])
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    return head, np.array(rows, dtype=float)


def test_the_columns_are_those_of_the_contract(host, tmp_path):
    head, rows = written(host, tmp_path / "table.csv", synthetic.result())
    target, motor = "/Robot/Tip/Target", "/Robot/Joints/Swing"
    names = [f"{target}.{name}" for name in ("x", "y", "z", "error", "rotation_error")]
    first = ["time_s", *names, f"{motor}.input", f"{motor}.output", f"{motor}.effort"]
    joints = [f"/Robot/Joints/{name}" for name in ("Mount", "Swing", "Weld")]
    reactions = [f"{joint}.{kind}.{axis}" for kind in ("force", "moment") for joint in joints for axis in "xyz"]
    before = [f"{name}_before" for name in names]
    assert head == [*first, *reactions, *before]
    expected = synthetic.motion(synthetic.CALM, 0.01)
    judged = expected.times >= -1e-9
    found = rows[:, len(first) : -len(before)].reshape(len(rows), 2, 3, 3)
    np.testing.assert_allclose(found[:, 0], expected.joint_forces[judged], atol=1e-11)
    np.testing.assert_allclose(found[:, 1], expected.joint_moments[judged], atol=1e-11)
    assert rows[0, 0] == 0.0 and rows[-1, 0] == pytest.approx(1.0)


def test_the_optimised_motion_is_written_beside_the_animators_curve(host, tmp_path):
    _, rows = written(host, tmp_path / "table.csv", synthetic.result())
    times = rows[:, 0]
    expected = synthetic.motion(synthetic.CALM, 0.01)
    judged = expected.times >= -1e-9
    np.testing.assert_allclose(rows[:, 1:4], expected.target_positions[judged, 0], atol=1e-11)
    np.testing.assert_allclose(rows[:, 6], synthetic.angle(times), atol=1e-11)
    np.testing.assert_allclose(rows[:, 7], expected.motor_values[judged, 0], atol=1e-11)
    assert np.abs(rows[:, 7] - rows[:, 6]).max() > 0.005
    shaken = synthetic.result().before
    times_before = shaken.motion.times[shaken.motion.judged]
    error = np.interp(times, times_before, shaken.position_errors[shaken.motion.judged, 0])
    np.testing.assert_allclose(rows[:, -2], error, atol=1e-11)
    assert rows[:, -2].max() > 2.0 * rows[:, 4].max()


def test_simulate_writes_the_simulated_motion(host, tmp_path):
    _, rows = written(host, tmp_path / "table.csv", synthetic.result(False))
    np.testing.assert_array_equal(rows[:, 6], rows[:, 7])
    assert rows[:, 4].max() > 0.02
    np.testing.assert_allclose(rows[:, 5], 2 * rows[:, 4], atol=1e-12)


def test_a_table_is_replaced_whole_and_readable_like_any_new_file(host, tmp_path):
    path, other = tmp_path / "table.csv", tmp_path / "other"
    path.write_text("old")
    other.touch()
    written(host, path, synthetic.result())
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE(other.stat().st_mode)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["other", "table.csv"]


def test_a_table_that_cannot_be_written_is_refused_by_name(host, tmp_path):
    (tmp_path / "taken").write_text("a file where a folder should be")
    path = tmp_path / "taken" / "table.csv"
    with pytest.raises(ShotError) as refused:
        written(host, path, synthetic.result())
    assert refused.value.path == str(path) and "--csv" in refused.value.remedy


def test_a_table_that_is_written_in_parts_is_whole(repository, tmp_path):
    path = repository / "plugins" / "table_writer" / "table.py"
    spec = importlib.util.spec_from_file_location("table_of_parts", path)
    table = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(table)
    values = {"a": np.arange(2.0 * table.AT_ONCE + 1.0), "b": np.zeros(2 * table.AT_ONCE + 1)}
    table.write_table(str(tmp_path / "long.csv"), values)
    lines = (tmp_path / "long.csv").read_bytes().decode().split("\r\n")
    assert lines[0] == "a,b" and lines[-1] == "" and len(lines) == 2 * table.AT_ONCE + 3
    assert lines[1:-1] == [f"{k},0" for k in range(2 * table.AT_ONCE + 1)]
