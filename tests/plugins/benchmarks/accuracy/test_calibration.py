"""The benchmark of calibrations."""

import numpy as np
import pytest

calibration = pytest.importorskip("calmotion_plugins.benchmarks.accuracy.calibration")  # needs the plugin calibration
HEADS, Recovered, main, table_of = (getattr(calibration, n) for n in ("HEADS", "Recovered", "main", "table_of"))
recorded_arm = calibration.recorded_arm


def row(trial, kind, error, deviation, identifiable=True):
    return Recovered(trial, kind, error, deviation, error / deviation, identifiable, True, 100, 1.0)


def test_the_table_counts_intervals_that_cover_the_truth():
    rows = [row(0, "modulus", 0.004, 0.004), row(1, "modulus", -0.03, 0.005), row(2, "modulus", 0.02, 0.02)]
    rows.append(row(0, "delay", 1e-3, 2e-3, False))
    modulus, delay = table_of(rows)
    # the interval of the third does not tell 1%
    assert modulus == ["modulus", "3", "67%", "2%", "3%", "0.5%", "3", "1%: 1 of 2"] and len(modulus) == len(HEADS)
    assert delay == ["delay", "1", "100%", "1 ms", "1 ms", "2 ms", "0", "1 ms: 0 of 0"]


@pytest.mark.long
def test_an_arm_is_the_same_every_time_and_its_parameters_are_recovered(tmp_path, capsys):
    one, other = recorded_arm(4), recorded_arm(4)
    assert one.truth == other.truth
    for a, b in zip(one.recordings, other.recordings, strict=True):
        assert np.array_equal(a.channels[0].values, b.channels[0].values, equal_nan=True)
    table = tmp_path / "rows.csv"
    main(["--count", "1", "--first", "4", "--csv", str(table)])
    assert "modulus" in capsys.readouterr().out and len(table.read_text().splitlines()) > 2
