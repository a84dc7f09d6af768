"""Angles that were wrapped: what jumps by a turn between two samples turns on, or is told."""

import numpy as np
import pytest
from calmotion.model import MotorTracks
from calmotion.usd.reading.shot import read_shot
from one_hinge import HINGE, ONE_HINGE

LIMITS = "float physics:lowerLimit = {}\n        float physics:upperLimit = {}\n        rel physics:body1"


def shot_with(tmp_path, degrees=None, limits=None, rate=24):
    """The shot of a hinge, with samples at its frames, and limits [deg]."""
    text = ONE_HINGE
    if degrees is not None:
        samples = ", ".join(f"{k * 24 / rate:.9g}: {value:.9g}" for k, value in enumerate(degrees))
        text = text.replace("0: 0, 6: 10, 12: 30, 18: 20, 24: 0", samples)
    if limits is not None:
        text = text.replace("rel physics:body1", LIMITS.format(*limits))
    (path := tmp_path / "shot.usda").write_text(text)
    return str(path)


def wrapped(degrees, low=-180.0):
    return (np.asarray(degrees) - low) % 360.0 + low


def values_and_notes(path, given=None):
    character, animation, _ = read_shot(path, given=given)
    return np.degrees(animation.tracks[0].values), [note for note in character.notes if " turn" in note]


TIMES = np.arange(49) / 48
MOTIONS = {
    "steady": 150 + 400 * TIMES,
    "back": -100 - 500 * TIMES,
    "to and fro over the seam": 180 + 40 * np.sin(7 * TIMES),
    "rocking on the seam": 180 + 3 * (-1.0) ** np.arange(49),
    "ten turns": 3600 * TIMES,
    "slow": 175 + 12 * TIMES,
    "creeping over the seam": 179.9 + 0.3 * TIMES**2,
}


@pytest.mark.parametrize("low", [-180.0, 0.0])
@pytest.mark.parametrize("limits", [None, (-4000, 4000)])
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_wrapped_angle_turns_on(tmp_path, motion, limits, low):
    written = wrapped(MOTIONS[motion], low)
    expected = MOTIONS[motion] + written[0] - MOTIONS[motion][0]
    jumps = np.abs(np.diff(written)).max() > 180.0
    values, notes = values_and_notes(shot_with(tmp_path, written, limits, rate=48))
    assert values == pytest.approx(expected, abs=1e-4)
    assert len(notes) == jumps and all("is unwrapped" in note for note in notes)
    given = MotorTracks("take.csv", TIMES, {"Hinge": np.radians(written)})
    values, notes = values_and_notes(shot_with(tmp_path, limits=limits), given)
    assert values == pytest.approx(expected, abs=1e-9) and len(notes) == jumps


def test_a_joint_whose_limits_do_not_let_it_turn_on_is_told(tmp_path):
    written = wrapped(150 + 60 * TIMES)
    values, (note,) = values_and_notes(shot_with(tmp_path, written, (-185, 185), rate=48))
    assert values == pytest.approx(written, abs=1e-4)
    assert "-185 to 185 deg" in note and "physics:lowerLimit" in note and "between 0.4792 and 0.5 s" in note


@pytest.mark.parametrize(
    "degrees",
    [
        pytest.param([0, 360, 360], id="a spin in a second and a rest"),
        pytest.param([0, 360, 720], id="two spins"),
        pytest.param(np.repeat([0, 200, 0], 24)[::24], id="a wide swing"),
        pytest.param([0] * 12 + [150] * 13, id="a step within a turn"),
        pytest.param(229.2 * np.arange(25), id="a wheel at 4 rad a frame"),
    ],
)
def test_what_is_keyed_so_stays(tmp_path, degrees):
    path = shot_with(tmp_path, degrees, rate=1 if len(degrees) == 3 else 24)
    values, notes = values_and_notes(path.replace("endTimeCode = 24", "endTimeCode = 48"))
    assert values[0] == 0 and values[-1] == pytest.approx(degrees[-1], rel=1e-5) and values.max() >= max(degrees) - 1e-3
    assert not notes


def test_degrees_that_were_taken_for_radians_are_told(tmp_path):
    given = MotorTracks("take.csv", TIMES, {"Hinge": wrapped(150 + 60 * TIMES)})
    _, notes = values_and_notes(shot_with(tmp_path), given)
    assert any("degrees taken for radians" in note and HINGE in note for note in notes)


def test_a_spline_that_turns_back_between_two_keys_is_told(tmp_path):
    ease = 0.5 * (1.0 - np.cos(np.pi * np.arange(1, 11) / 10))
    degrees = np.concatenate([np.linspace(0.0, 350.0, 100), 350.0 - 345.0 * ease, np.linspace(5.0, 100.0, 91)[1:]])
    given = MotorTracks("take.csv", np.arange(200) / 240.0, {"Hinge": np.radians(degrees)})
    values, (note,) = values_and_notes(shot_with(tmp_path), given)
    assert values == pytest.approx(degrees, abs=1e-4) and "do its keys wrap?" in note and "within 0.0417 s" in note
