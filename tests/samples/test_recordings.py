"""The recording of every sample read back: what is in it, when, and with the values of the table."""

import pytest
from sample_recordings import check_recording
from sample_shots import KINDS, path_of

# bodies and skeletons are animated in other tests, too
LONG = dict.fromkeys(("dancer", "drummer", "boxer", "rapper", "lamp"), pytest.mark.long)
FINE = {"lamp": "1mm"}  # at 20 mm its stiff links need no modes


@pytest.mark.parametrize("name", [pytest.param(name, marks=LONG.get(name, ())) for name in KINDS])
def test_the_recording_of_a_simulation_contains_the_data_of_the_table(name, calmotion, tmp_path):
    files = tmp_path / "table.csv", tmp_path / "run.rrd"
    run = calmotion(
        "simulate", path_of(name), "--csv", files[0], "--rrd", files[1], "--tolerance", FINE.get(name, "20mm"),
        "--set", "rerun.log.samples_per_plot=100000",
    )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr
    check_recording(files[1], files[0], path_of(name), "input")
    assert files[1].stat().st_size < 60e6
