"""An animation at another tempo: everything in it is a function of the animation's own time."""

import numpy as np
import pytest
from calmotion.model import Animation, FreeTrack, MovingFrame, Track, WeightTrack
from calmotion.model.curves import held_curve, retimed, root_at
from calmotion.model.tempo import TimeMap
from scipy.spatial.transform import Rotation

FRAMES = np.arange(25) / 24.0


def animation(rate=1.0):
    """A motor, a root that moves and turns, a weight and a locked range, all slower by a factor."""
    times = FRAMES * rate
    turned = Rotation.from_rotvec(np.outer(2.0 * np.sin(3.0 * FRAMES), [0.0, 0.0, 1.0])).as_quat()
    root = MovingFrame(0, times, np.stack([np.sin(FRAMES), FRAMES**2, 0 * FRAMES], axis=1), np.roll(turned, 1, axis=1))
    tracks = (Track(times, np.sin(4.0 * FRAMES)),)
    return Animation(
        times, tracks, tracks, (root,), (WeightTrack(0, False, times[[3, 9]], np.array([1.0, 0.5])),),
        (FreeTrack(times[[0, 12]], np.array([True, False]), 0),),
    )  # fmt: skip


def swinging_map():
    times = np.linspace(0.0, 1.0, 30)
    return TimeMap(times, times + 0.5 * times + 0.1 * np.sin(2.0 * np.pi * times))


def test_times_of_the_animation_and_of_the_performance_are_inverse():
    tempo, times = swinging_map(), np.linspace(-0.2, 1.3, 200)
    assert tempo.animated(tempo.performed(times)) == pytest.approx(times, abs=1e-12)
    h = 1e-6
    slope = (tempo.performed(times[40:100] + h) - tempo.performed(times[40:100] - h)) / (2.0 * h)
    assert tempo.stretch(times[40:100]) == pytest.approx(slope, rel=1e-8)
    assert tempo.added == pytest.approx(0.5)


def test_one_tempo_for_the_whole_is_the_shot_with_other_time_codes():
    given, slower = animation(), animation(1.5)
    found = retimed(given, TimeMap(np.linspace(0.0, 1.0, 4), np.linspace(0.0, 1.5, 4)), np.arange(37) / 24.0)
    times = np.linspace(0.0, 1.5, 100)
    for one, other in zip(found.tracks, slower.tracks, strict=True):
        assert held_curve(one, 1.5)(times, 0) == pytest.approx(held_curve(other, 1.5)(times, 0), abs=2e-4)
    assert found.weights[0].times == pytest.approx(slower.weights[0].times)
    assert np.array(found.free[0].locked(1.5)) == pytest.approx(np.array(slower.free[0].locked(1.5)))
    (one,), (other,) = found.moving, slower.moving
    assert (root_at(one, times).inv() * root_at(other, times)).magnitude().max() < 2e-3
    assert found.tempo is not None and found.current is found.tracks


def test_tracks_are_the_animation_at_the_time_of_the_map_and_denser_where_they_must_be():
    tempo, given = swinging_map(), animation()
    fast = Track(FRAMES, np.sin(70.0 * FRAMES))
    given = Animation(FRAMES, (given.tracks[0], fast), (given.tracks[0], fast))
    found = retimed(given, tempo, np.arange(37) / 24.0)
    times = np.linspace(0.0, 1.5, 400)
    for one, other in zip(found.tracks, given.tracks, strict=True):
        wanted = held_curve(other, 1.0)(tempo.animated(times), 0)
        assert held_curve(one, 1.5)(times, 0) == pytest.approx(wanted, abs=5e-4)
    assert len(found.tracks[0].times) < len(found.tracks[1].times)
    assert np.min(np.abs(found.tracks[1].times[:, None] - found.frame_times), axis=0).max() < 1e-9


def test_corners_stay_corners():
    track = Track(np.array([0.0, 0.25, 0.5, 0.75, 1.0]), np.array([0.0, 0.5, 1.0, 0.5, 0.0]), np.array([0.5]))
    tempo = swinging_map()
    (found,) = retimed(Animation(FRAMES, (track,), (track,)), tempo, np.arange(37) / 24.0).tracks
    (corner,) = found.corners
    assert corner == pytest.approx(tempo.performed(np.array([0.5]))[0])
    slopes = held_curve(found, 1.5)(corner + np.array([-1e-4, 1e-4]), 1)
    assert slopes[0] > 0.5 and slopes[1] < -0.5
