"""A shot that is run again after one key was moved."""

import numpy as np
import pytest
from calmotion.benchmarks.watching.edits import MOVED, REACH, Edit, measure_edit, table, tracks_of, with_moved_key
from calmotion.workflow.shot import Shot
from one_hinge import HINGE, ONE_HINGE


@pytest.fixture
def path(tmp_path):
    found = tmp_path / "hinge.usda"
    found.write_text(ONE_HINGE)
    return str(found)


def test_one_key_of_the_motor_that_moves_most_is_moved():
    times = np.linspace(0.0, 2.0, 97)
    columns = {"time_s": times, "/a": 0.1 * times, "/b": np.sin(times)}
    moved = with_moved_key(columns)
    change = moved["/b"] - columns["/b"]
    assert (
        moved["/a"] is columns["/a"]
        and change.max() == pytest.approx(MOVED)
        and abs(times[change.argmax()] - 1.0) < 1e-9
    )
    np.testing.assert_allclose(change[np.abs(times - 1.0) > REACH + 1e-9], 0.0, atol=1e-15)


def test_both_runs_are_measured(path):
    assert set(tracks_of(Shot(path))) == {"time_s", HINGE}
    edit = measure_edit(path, "simulate")
    assert edit.shot == "hinge" and edit.first["retarget.simulate"] > 0.0 and edit.again["retarget.simulate"] > 0.0
    assert edit.ratio == pytest.approx(sum(edit.again.values()) / sum(edit.first.values()))
    assert edit.sweeps == (0, 0) and edit.first_s > 0.0 < edit.again_s


def test_the_ratio_of_an_optimisation_is_that_of_its_searches():
    first, again = {"fe.mesh": 5.0, "retarget.optimize": 4.0}, {"fe.mesh": 0.0, "retarget.optimize": 1.0}
    edit = Edit("arm", "optimize", first, again, 9.0, 1.5, ("meshes", "curves"), (100, 20), (1.0, 0.9))
    assert edit.ratio == 0.25
    row = "| arm | optimize: search | 4.00 | 1.00 | 0.25 | 9.00 | 1.50 | 100 | 20 | 1.00 | 0.90 | meshes, curves |"
    assert row in table([edit])
