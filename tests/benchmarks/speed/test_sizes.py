"""Growth of whole runs: the shot of many arms is what it says, and growth beyond the problem is seen."""

import numpy as np
import pytest
from calmotion.benchmarks.scenes.many_arms import LENGTH, write_many_arms
from calmotion.benchmarks.speed import sizes
from calmotion.benchmarks.speed.sizes import Run, exponents, table
from calmotion.usd.reading import read_shot


def run_of(bodies, search):
    return Run("bodies and motors", bodies, bodies, 24, {"read": 0.5, "search": search}, 40, 300.0)


def test_many_arms_have_the_bodies_motors_targets_and_frames_that_are_asked_for(tmp_path):
    character, animation, _ = read_shot(str(write_many_arms(tmp_path / "arms.usda", 12, 5, 30)))
    assert len(character.bodies) == 13 and len(character.motors) == 5 and len(character.targets) == 3
    assert len(animation.frame_times) == 31 and sum(body.flexible is not None for body in character.bodies) == 12
    assert all(np.ptp(track.values) > 0.1 for track in animation.tracks)
    places = {body.path.rpartition("/")[2]: body.rest.position for body in character.bodies}
    for k in range(1, 5):
        np.testing.assert_allclose(places[f"Link{k}"] - places[f"Link{k - 1}"], [0.0, 0.0, LENGTH], atol=1e-9)


def test_growth_is_between_the_last_sizes_and_of_stages_that_take_long_enough():
    found = exponents([run_of(10, 9.0), run_of(100, 10.0), run_of(200, 40.0)])
    assert found["search"] == pytest.approx(2.0) and "read" not in found
    assert found["all"] == pytest.approx(np.log2(40.5 / 10.5)) and exponents([run_of(10, 9.0)]) == {}
    text = table([run_of(100, 10.0), run_of(200, 40.0)])
    assert "| 200 | 200 | 24 | 0.5 |" in text and "exponent of bodies and motors" in text and "| 2.00 |" in text


@pytest.mark.parametrize(("search", "status"), [(19.0, 0), (40.0, 1)])
def test_the_command_fails_when_the_cost_grows_faster_than_the_problem(monkeypatch, capsys, search, status):
    runs = {100: run_of(100, 10.0), 200: run_of(200, search)}
    monkeypatch.setattr(sizes, "QUICK", {"bodies and motors": ((100, 100, 24), (200, 200, 24))})
    monkeypatch.setattr(sizes, "measured", lambda law, bodies, motors, frames: runs[bodies])
    assert sizes.main(["--quick"]) == status and "| 100 |" in capsys.readouterr().out


@pytest.mark.long
def test_two_small_shots_are_measured():
    assert sizes.main(["--quick"]) == 0
