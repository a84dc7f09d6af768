"""Tracks that are given beside a shot: which joint each moves, and how long they are."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import MotorTracks
from calmotion.usd.reading.motors.given_tracks import JointNames, length_note, tracks_of_joints
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


ROBOT = {
    "/R/elbow": JointNames(("elbow",)),
    "/R/slide": JointNames(("slide",), linear=True),
    "/R/x_deg": JointNames(("x_deg",)),
}
DEGREE = np.pi / 180.0


@pytest.mark.parametrize(
    ("columns", "expected"),
    [
        ({"elbow_deg": 90.0, "slide_mm": 5.0}, {"/R/elbow": 90.0 * DEGREE, "/R/slide": 0.005}),
        ({"Elbow.pos": 90.0, "SLIDE": 5.0}, {"/R/elbow": 90.0 * DEGREE, "/R/slide": 5.0}),
        ({"/joint_states/elbow/position": 90.0}, {"/R/elbow": 90.0 * DEGREE}),
        ({"elbow_rad": 1.0, "elbow_vel": 3.0, "elbow/effort": 2.0}, {"/R/elbow": 1.0}),
        ({"x_deg": 90.0}, {"/R/x_deg": 90.0 * DEGREE}),
        ({"x_deg_rad": 1.0, "/R/slide": 2.0}, {"/R/x_deg": 1.0, "/R/slide": 2.0}),
    ],
)
def test_a_column_may_have_a_topic_before_and_a_quantity_or_a_unit_behind(columns, expected):
    """Angles without a unit are in degrees here; lengths never are."""
    given = MotorTracks("take.csv", np.zeros(1), {name: np.array([v]) for name, v in columns.items()}, angle_unit="deg")
    found, notes = tracks_of_joints(given, ROBOT)
    assert {path: values[0] for path, values in found.values.items()} == pytest.approx(expected)
    taken = [name for name in columns if name not in ("x_deg", "SLIDE", "/R/slide")]
    assert all(name in " ".join(notes) for name in taken) and bool(notes) == bool(taken)


@pytest.mark.parametrize(
    ("columns", "units", "message"),
    [
        (["slide_deg"], {}, "slide_deg in deg"),
        (["elbow"], {"elbow": "mm"}, "elbow in mm"),
        (["elbow", "elbow_deg"], {}, "two columns move the same joint"),
        (["elbow_vel"], {}, "no column has positions"),
        (["knee_deg"], {}, "no joint of the robot has this name"),
    ],
)
def test_a_column_that_no_joint_can_follow_is_refused(columns, units, message):
    with pytest.raises(ShotError) as refused:
        tracks_of_joints(MotorTracks("take.csv", np.zeros(1), dict.fromkeys(columns, np.zeros(1)), units), ROBOT)
    assert message in str(refused.value) and refused.value.path == "take.csv" and refused.value.remedy


@pytest.mark.parametrize(
    ("end", "told"), [(1.0, ""), (1.03, ""), (1000.0, "comes later is not played"), (0.5, "last pose is held")]
)
def test_a_motion_of_another_length_than_the_shot_is_told(tmp_path, end, told):
    note = length_note(tracks(end, shoulder=(0.0, 0.1)), np.arange(25) / 24.0)
    assert (told in note) if told else note == ""
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda")), given=tracks(end, shoulder=(0.0, 0.1)))
    assert [one for one in character.notes if "take.csv lasts" in one] == ([note] if told else [])
