"""Tracks that are given beside a shot: which joint each moves, and how long they are."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import MotorTracks
from calmotion.usd.reading.motors.given_tracks import length_note
from calmotion.usd.reading.shot import read_shot
from small_shots import ELBOW, SHOULDER, write_arm


def tracks(end=1.0, **values):
    return MotorTracks("take.csv", np.array([0.0, end]), {name: np.array(pair) for name, pair in values.items()})


@pytest.mark.parametrize("name", ["shoulder", SHOULDER, "1-pan!"])
def test_joints_are_named_by_path_or_name(tmp_path, name):
    shot = str(write_arm(tmp_path / "arm.usda", lambda stage: stage.GetPrimAtPath(SHOULDER).SetDisplayName("1-pan!")))
    given = MotorTracks("take.csv", np.array([0.0, 1.0]), {name: np.array([0, 0.1]), ELBOW: np.array([0, 0.2])})
    character, animation, _ = read_shot(shot, given=given)
    ends = {motor.path: track.values[-1] for motor, track in zip(character.motors, animation.tracks, strict=True)}
    assert ends == {SHOULDER: 0.1, ELBOW: 0.2}


def test_two_columns_of_one_joint_are_refused(tmp_path):
    shot = str(write_arm(tmp_path / "arm.usda"))
    given = MotorTracks("take.csv", np.array([0.0, 1.0]), {"shoulder": np.array([0.0, 0.1]), SHOULDER: np.zeros(2)})
    with pytest.raises(ShotError, match="two columns move the same joint") as refused:
        read_shot(shot, given=given)
    assert refused.value.path == "take.csv" and "shoulder" in str(refused.value.found)


@pytest.mark.parametrize(
    ("end", "told"), [(1.0, ""), (1.03, ""), (1000.0, "comes later is not played"), (0.5, "last pose is held")]
)
def test_a_motion_of_another_length_than_the_shot_is_told(tmp_path, end, told):
    note = length_note(tracks(end, shoulder=(0.0, 0.1)), np.arange(25) / 24.0)
    assert (told in note) if told else note == ""
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda")), given=tracks(end, shoulder=(0.0, 0.1)))
    assert [one for one in character.notes if "take.csv lasts" in one] == ([note] if told else [])
