"""The benchmark of takes."""

import json

import pytest
from calmotion.benchmarks.accuracy.takes import main
from swung_plastic import ease, swung_plastic


@pytest.mark.long
def test_takes_of_a_small_arm_come_closer_to_what_was_intended(tmp_path, capsys):
    shot = swung_plastic(tmp_path / "shot.usda", lambda t: 30.0 * ease((t - 0.2) / 0.6), 26)
    main([str(shot), "--takes", "2", "--draws", "20", "--folder", str(tmp_path / "takes"), "--json"])
    first, second = json.loads(capsys.readouterr().out)
    assert second["take"] == 2 and second["on_robot"] < 0.5 * first["on_robot"]
    assert set(second["off"]) and second["largest"] >= second["median"] >= 0.0
    assert (tmp_path / "takes" / "take1_marker.csv").exists()
