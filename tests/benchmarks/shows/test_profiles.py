"""Errors of targets over time: the largest of each, when it is, and how far two runs are apart."""

import numpy as np
import pytest
from calmotion.benchmarks.shows.profiles import apart, errors_table, target_errors

HEAD = "time_s,/T.x,/T.y,/T.z,/T.error,/T.rotation_error\n"


def test_tables_of_two_runs_are_compared_at_the_same_times(tmp_path):
    (tmp_path / "a.csv").write_text(HEAD + "-0.1,9,9,9,9,0\n0,0,0,0,0.1,0\n0.1,0.003,0,0,0.2,0\n")
    (tmp_path / "b.csv").write_text(HEAD + "0,0,0,0,0.1,0\n0.05,0,0,0,0.1,0\n0.1,0,0.004,0,0.1,0\n")
    found = apart(tmp_path / "a.csv", tmp_path / "b.csv")
    assert (found.distance_m, found.profile_m, found.profile_s) == pytest.approx((0.005, 0.1, 0.1))
    assert found.profile_rms_m == pytest.approx(np.sqrt(0.01 / 2))


def test_each_target_has_its_own_errors_before_and_after_and_the_instant_of_the_largest(tmp_path):
    table = tmp_path / "a.csv"
    table.write_text(HEAD + "-0.1,0,0,0,9,0\n0,0,0,0,0.001,0\n0.1,0,0,0,0.004,0\n0.2,0,0,0,0.002,0\n")
    row = {"path": "/T", "max_error_before_m": 0.05, "max_error_after_m": 0.004, "rms_error_after_m": 0.003}
    (found,) = target_errors({"targets": [row]}, table)
    assert (found.before_mm, found.after_mm, found.after_s, found.rms_mm) == pytest.approx((50.0, 4.0, 0.1, 3.0))
    assert "| /T | 50.0 mm | 4.00 mm | 0.10 s | 3.00 mm |" in errors_table([found])
