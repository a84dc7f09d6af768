"""Held and stepped keys: no overshoot, no lost acceleration, and smooth samples as they were."""

import numpy as np
import pytest
from calmotion.model import MotorTracks, Track
from calmotion.model.curves import held_curve, interpolate
from calmotion.usd.reading.shot import read_shot
from one_hinge import HINGE, ONE_HINGE

FRAMES = np.arange(25) / 24
FINE = np.linspace(0.0, 1.0, 20001)


def read(tmp_path, times, degrees):
    """The track of samples, and what is said of steps."""
    (path := tmp_path / "shot.usda").write_text(ONE_HINGE)
    given = MotorTracks("take.csv", np.asarray(times, float), {"Hinge": np.radians(degrees)})
    character, animation, _ = read_shot(str(path), given=given)
    return animation.tracks[0], [note for note in character.notes if "are held and step" in note]


HELD = {
    "a step": (30.0 * (FRAMES > 0.5), 1),
    "a step back": (30.0 * (FRAMES < 0.5), 1),
    "in the first frame": (30.0 * (FRAMES > 0.03), 1),
    "in the last frame": (30.0 * (FRAMES > 0.97), 1),
    "on twos": (10.0 * (np.arange(25) // 2), 12),
    "on threes, up and down": (np.array([0, 20, -5, 7, 0, 30, 2, 2, 9.0])[np.arange(25) // 3], 7),
    "with a sample in the step": (np.array([0.0] * 8 + [1] + [30] * 16), 1),
    "with two": (np.array([0.0] * 8 + [1, 29.5] + [30] * 15), 1),
    "a blow": (30.0 * (np.arange(25) == 10), 1),
    "a brief hold": (30.0 * ((np.arange(25) == 10) | (np.arange(25) == 11)), 2),
    "after a smooth motion": (np.concatenate([60 * np.sin(FRAMES[:13] * np.pi) ** 2, [60] * 6, [65] * 6]), 1),
}


@pytest.mark.parametrize("name", HELD)
def test_steps_do_not_overshoot_and_are_told(tmp_path, name):
    degrees, count = HELD[name]
    track, notes = read(tmp_path, FRAMES, degrees)
    curve = held_curve(track, 1.0)
    assert np.degrees(curve(FRAMES, 0)) == pytest.approx(degrees, abs=1e-9)
    near = 1e-3 if "smooth" in name else 1e-9  # the cubic at the begin of the smooth motion
    assert np.degrees(curve(FINE, 0)).min() >= degrees.min() - near
    assert np.degrees(curve(FINE, 0)).max() <= degrees.max() + 1e-9
    # accelerations are continuous: the simulation takes derivatives of them
    bend, jerk = curve(FINE, 2), curve(FINE, 3)
    assert np.abs(np.diff(bend)).max() <= 1.01 * np.abs(jerk).max() * FINE[1]
    assert len(notes) == 1 and "Hz" in notes[0] and (f"{count} times" in notes[0] or count == 1)


def test_a_step_reaches_twice_its_mean_speed_and_is_named_with_it(tmp_path):
    track, (note,) = read(tmp_path, FRAMES, HELD["a step"][0])
    curve, way = held_curve(track, 1.0), np.radians(30)
    assert np.abs(curve(FINE, 1)).max() == pytest.approx(2 * way * 24, rel=1e-3)
    assert np.abs(curve(FINE, 2)).max() == pytest.approx(8 * way * 24**2, rel=1e-2)
    assert "by 30 deg between 0.5 and 0.5417 s" in note and "up to about 24 Hz" in note


@pytest.mark.parametrize(
    ("times", "degrees"),
    [
        ([0, 0.4, 0.5, 1], [0, 0, 30, 30]),
        ([0, 0.3, 0.7, 1], [0, 30, 30, 0]),
        ([0, 0.25, 0.5, 0.75, 1], [0, 30, 30, -10, -10]),
        ([0, 0.2, 0.4, 0.6, 0.8, 1], [5, 5, 5, -5, -5, 5]),
    ],
)
def test_keys_of_equal_values_hold(tmp_path, times, degrees):
    track, _ = read(tmp_path, times, degrees)
    values = np.degrees(held_curve(track, 1.0)(FINE, 0))
    assert values.min() >= min(degrees) - 1e-9 and values.max() <= max(degrees) + 1e-9
    for k in np.flatnonzero(np.diff(degrees) == 0):
        inside = (FINE >= times[k]) & (FINE <= times[k + 1])
        assert values[inside] == pytest.approx(degrees[k], abs=1e-9)


def ease(frames):
    share = np.clip((FRAMES - 0.25) * 24 / frames, 0.0, 1.0)
    return 30 * share**2 * (3 - 2 * share)


@pytest.mark.parametrize(
    "degrees",
    [
        pytest.param(30 * np.sin(7 * FRAMES), id="a wave"),
        pytest.param(30 * np.sin(2 * np.pi * (FRAMES - 1 / 48)), id="equal samples at a peak"),
        pytest.param(np.round(30 * FRAMES**2, 1), id="rounded"),
        pytest.param(ease(12), id="ease from hold to hold"),
        pytest.param(ease(5), id="fast ease"),
        pytest.param(np.interp(FRAMES, [0.25, 0.75], [0, 30]), id="line from hold to hold"),
        pytest.param(np.repeat([-22, -7, 8, -10, -10], 5)[np.arange(25)] * 0.0 + 4.0, id="still"),
    ],
)
def test_smooth_samples_are_read_as_they_were(tmp_path, degrees):
    track, notes = read(tmp_path, FRAMES, degrees)
    assert np.array_equal(track.times, FRAMES) and not notes
    assert np.array_equal(interpolate(track, 1.0)(FINE), interpolate(Track(FRAMES, np.radians(degrees)), 1.0)(FINE))


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
