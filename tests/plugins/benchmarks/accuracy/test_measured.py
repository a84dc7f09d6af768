"""`calmotion bench measured`: which recordings are fitted together, and how often intervals hold."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion_plugins.benchmarks.accuracy.cantilever import MEASURED, cantilever
from calmotion_plugins.benchmarks.accuracy.measured import choices, covered, machine_in
from calmotion_plugins.calibration import Calibration, Estimate

NAMES = ("sweep_100", "sweep_400", "hold_100", "hold_400")


def test_fits_take_different_motions_and_are_spread_over_all():
    found = choices(NAMES, 2, None)
    assert len(found) == 4 and all(a.split("_")[0] != b.split("_")[0] for a, b in found)
    assert choices(NAMES, 2, 2) == [found[0], found[-1]]
    assert choices(("h20", "h30", "hm20"), 1, None) == [("h20",), ("h30",), ("hm20",)]


def fit(value, deviation, nominal=1.0):
    own = Estimate("position_gain", "/a", -1, "", nominal, 0.3, value, deviation, True, True)
    clock = Estimate("clock_offset", "f", -1, "s", 0.0, 0.01, 0.0, 0.01, False, True)
    return Calibration((own, clock), np.eye(2), {}, (), (), True, 1, 1, 1e-3, 0.0, 1.0)


def test_intervals_are_compared_with_estimates_of_disjoint_fits_as_factors():
    fits = {("a", "b"): fit(1.0, 0.1), ("c", "d"): fit(2.3, 0.01, nominal=2.0), ("a", "c"): fit(9.0, 0.1)}
    assert covered(fits) == {"position_gain /a": (1, 2)}


def test_a_folder_without_recorded_shots_is_refused(tmp_path):
    (tmp_path / "a.usda").write_text("#usda 1.0\n")
    with pytest.raises(ShotError, match="two recorded shots") as caught:
        machine_in(tmp_path)
    assert "NAME.csv" in caught.value.remedy


def test_three_frequencies_of_a_published_cantilever_follow_from_its_geometry_and_one_modulus():
    found, modulus = cantilever()
    assert np.abs(found / MEASURED - 1.0).max() < 0.015
    assert 1.5e11 < modulus < 2.2e11
