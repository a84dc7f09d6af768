"""Long performances for measurements: of a shot's own poses, varied, and a longer one begins as a shorter one."""

import numpy as np
import pytest
from calmotion.benchmarks.shows.profiles import TargetErrors
from calmotion.benchmarks.shows.windows import LongRun, exponent, performance, table, write_performance
from calmotion.workflow.shot import Shot
from one_hinge import HINGE, ONE_HINGE


@pytest.fixture
def shot(tmp_path):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    return Shot(tmp_path / "shot.usda").read()


def test_a_longer_performance_begins_as_a_shorter_one_and_is_not_repeated(shot):
    short, long = performance(shot, 8.0), performance(shot, 20.0)
    rows = len(short["time_s"]) - 60
    np.testing.assert_array_equal(short[HINGE][:rows], long[HINGE][:rows])
    assert long["time_s"][-1] == pytest.approx(20.0) and len(long["time_s"]) == 481
    half = long[HINGE][:240]
    assert np.abs(half - long[HINGE][240:480]).max() > 0.05
    assert np.degrees(long[HINGE]).max() < 31.0 and np.degrees(long[HINGE]).min() > -2.0


def test_a_performance_is_a_shot_of_its_length(shot, tmp_path):
    root, motion = write_performance(shot, 5.0, tmp_path)
    read = Shot(root, motion).read()
    assert read.animation.frame_times[-1] == pytest.approx(5.0)
    np.testing.assert_allclose(read.animation.tracks[0].values, performance(shot, 5.0)[HINGE], atol=1e-9)


def run(seconds, search):
    errors = TargetErrors("/T/Elbow", 20.0, 1.0, 0.4, 0.5), TargetErrors("/T/Cup", 60.0, 0.9, 0.7, 0.3)
    return LongRun(seconds, 1, search, search, search, search, 0.5, errors, True, "converged")


def test_growth_and_tables():
    runs = [run(10.0, 2.0), run(100.0, 20.0)]
    assert exponent(runs) == pytest.approx(1.0) and np.isnan(exponent(runs[:1]))
    row = "| 100 s | 1 | 20.0 s | 20.0 s | 20.0 s | 20.0 s | 0.50 GB | 20.0 mm | 1.00 mm | 0.50 mm | Elbow | kept |"
    assert row in table(runs)
