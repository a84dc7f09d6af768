"""Videos: they show the shot and then its worst moment in slow motion, frame by frame, and are whole or absent."""

import dataclasses
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import synthetic
from calmotion.errors import ShotError
from calmotion.host import PluginError
from calmotion.model.run import OutputPaths
from calmotion.testing import host_with, run_operator
from PIL import Image, ImageSequence

PLUGIN = Path(__file__).resolve().parents[2] / "plugins" / "video"
SMALL = {"video.write": {"width": 320, "rate": 8.0, "slow": 0.5}}
ORANGE, BLUE = (213, 94, 0), (0, 114, 178)


@pytest.fixture(scope="module")
def video():
    """The plugin's package, as the host imports it."""
    host = host_with(PLUGIN)
    package = host.operators["video.write"].__module__
    __import__(f"{package}.film")
    return sys.modules[package]


def write(path, result, settings=None):
    values = [synthetic.character(), synthetic.animation(), result, OutputPaths(video=str(path))]
    return run_operator(host_with(PLUGIN), "video.write", values, settings or SMALL)[0].path


def ink(picture, color):
    """Pixels of a color."""
    return np.all(np.abs(np.asarray(picture.convert("RGB")).astype(int) - color) < 12, axis=-1)


def test_a_slower_part_tells_its_tempo_and_what_forces_it(video):
    character, result = synthetic.character(), synthetic.retimed_result()
    film, _ = video.film.plan(character, synthetic.animation(), result, video.film.Settings(320, 8.0, 0.5))
    assert film.pace.text(0.5) == f"tempo {film.pace.percent[np.searchsorted(film.pace.times, 0.5)]:.0f}%: " + (
        f"velocity of {character.motors[0].path}"
    )
    assert film.pace.text(0.05) == ""
    frames = [
        video.film.draw_frame(dataclasses.replace(film, pace=pace), video.timeline.Moment(0.5, 0.0, 1.0))
        for pace in (film.pace, None)
    ]
    assert np.any(np.asarray(frames[0]) != np.asarray(frames[1]))


def test_a_video_plays_the_shot_then_its_worst_moment_and_is_twice_the_same(tmp_path, video):
    result = synthetic.result()
    first, second = (Path(write(tmp_path / f"{name}.webp", result)) for name in "ab")
    assert first.read_bytes() == second.read_bytes()
    assert sorted(os.listdir(tmp_path)) == ["a.webp", "b.webp"]
    _, frames = video.film.plan(
        synthetic.character(), synthetic.animation(), result, video.film.Settings(320, 8.0, 0.5)
    )
    with Image.open(first) as film:
        assert film.width == 320 and film.info["loop"] == 0
        pictures = [frame.convert("RGB") for frame in ImageSequence.Iterator(film)]
        # A frame that equals the one before is stored as a longer one.
        assert 0.6 * len(frames) <= len(pictures) <= len(frames)
    first, later = (np.asarray(picture).astype(int) for picture in (pictures[0], pictures[6]))
    assert np.abs(later - first).max() > 50


def test_the_moments_are_the_whole_shot_then_the_time_about_the_worst_error(video):
    result = synthetic.result()
    worst = video.timeline.worst_moment(result)
    run = result.before
    assert run.position_errors[:, 0].max() == np.interp(worst.time, run.motion.times, run.position_errors[:, 0])
    frames = video.timeline.moments(0.0, 1.0, worst, 25.0, 0.2)
    wide = [m.time for m in frames if m.near == 0.0]
    np.testing.assert_allclose(np.diff(wide), 0.04)
    assert wide[0] == 0.0 and wide[-1] == pytest.approx(1.0)
    slow = [m.time for m in frames if m.near == 1.0 and m.speed]
    assert slow == sorted(slow) and 0.0 <= slow[0] and slow[-1] <= 1.0
    assert min(np.diff(slow)) == pytest.approx(0.008) and worst.time in [m.time for m in frames if not m.speed]
    near = [m.near for m in frames]
    assert near == sorted(near), "the camera comes near once"
    assert [m.near for m in video.timeline.moments(0.0, 1.0, worst, 25.0, 1.0)] == [0.0] * len(wide)


def test_numbers_and_curves_are_the_errors_of_the_simulations(video):
    result = synthetic.result()
    film, _ = video.film.plan(synthetic.character(), synthetic.animation(), result, video.film.Settings(320))
    before, after = film.chart.curves
    rows = result.before.motion.judged
    np.testing.assert_allclose(before.values, 1e3 * result.before.position_errors[rows, 0])
    np.testing.assert_allclose(after.values, 1e3 * result.after.position_errors[rows, 0])
    ((x, y),) = film.chart.place(np.array([0.5]), np.array([film.chart.top]))
    left, top, right, _ = film.chart.box
    assert (x, y) == pytest.approx((0.5 * (left + right), top))
    assert film.chart.top >= before.values.max() > film.chart.top / 2.01


def test_the_near_view_keeps_the_intended_target_in_its_middle(video):
    result = synthetic.result()
    film, frames = video.film.plan(synthetic.character(), synthetic.animation(), result, video.film.Settings(320))
    for moment in (m for m in frames if m.near == 1.0):
        camera = film.stage.camera_at(moment)
        place = [np.interp(moment.time, result.reference.times, x) for x in result.reference.target_positions[:, 0].T]
        np.testing.assert_allclose(camera.project(np.array(place))[:2], 0.5 * np.array(camera.size), atol=1.0)
    assert film.stage.zoom > 1.0


def test_a_simulation_alone_fills_the_width_and_a_shot_without_targets_has_no_chart(video):
    for result, colors in ((synthetic.result(), (True, True)), (synthetic.result(optimized=False), (True, False))):
        film, frames = video.film.plan(synthetic.character(), synthetic.animation(), result, video.film.Settings(480))
        picture = video.film.draw_frame(film, frames[12])
        assert picture.width == 480
        assert (bool(ink(picture, ORANGE).any()), bool(ink(picture, BLUE).any())) == colors
    character = dataclasses.replace(synthetic.character(), targets=())
    empty = np.zeros((len(result.before.motion.times), 0))
    bare = {"target_positions": empty[..., None].repeat(3, 2), "target_rotations": empty[..., None].repeat(4, 2)}
    before = dataclasses.replace(
        result.before, position_errors=empty, rotation_errors=empty,
        motion=dataclasses.replace(result.before.motion, **bare),
    )  # fmt: skip
    reference = dataclasses.replace(result.reference, **bare)
    result = dataclasses.replace(result, before=before, reference=reference)
    film, frames = video.film.plan(character, synthetic.animation(), result, video.film.Settings(320))
    assert film.chart is None and all(moment.near == 0.0 for moment in frames)
    assert video.film.draw_frame(film, frames[3]).width == 320


def test_an_interrupted_video_leaves_nothing(tmp_path, video):
    def draw(number):
        if number == 3:
            raise KeyboardInterrupt
        return Image.new("RGB", (32, 32), (number, 0, 0))

    with pytest.raises(KeyboardInterrupt):
        video.encoding.encode(str(tmp_path / "a.webp"), map(draw, range(9)), 9, 25.0, 50)
    assert os.listdir(tmp_path) == []


def test_other_kinds_of_files_and_a_missing_ffmpeg_are_refused_with_what_to_do(tmp_path, video, monkeypatch):
    with pytest.raises(ShotError, match="not supported") as refused:
        write(tmp_path / "a.gif", synthetic.result())
    assert ".webp" in refused.value.remedy
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(ShotError, match="ffmpeg") as refused:
        write(tmp_path / "a.mp4", synthetic.result())
    assert "Install ffmpeg" in refused.value.remedy
    assert os.listdir(tmp_path) == []


def test_mp4_is_what_ffmpeg_makes_of_the_frames_and_its_failure_is_reported(tmp_path, video, monkeypatch):
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\ncat > "$last"\n')
    program.chmod(0o755)
    frames = [Image.new("RGB", (5, 4), (k, 1, 2)) for k in range(3)]
    video.encoding.encode(str(tmp_path / "a.mp4"), iter(frames), 3, 25.0, 50)
    expected = b"".join(frame.crop((0, 0, 4, 4)).tobytes() for frame in frames)
    assert (tmp_path / "a.mp4").read_bytes() == expected, "widths are even, frames in order"
    program.write_text("#!/bin/sh\necho 'Unknown encoder' >&2\nexit 3\n")
    with pytest.raises(ShotError, match="Unknown encoder"):
        video.encoding.encode(str(tmp_path / "b.mp4"), iter(frames), 3, 25.0, 50)
    assert not (tmp_path / "b.mp4").exists()


def test_it_is_skipped_when_no_video_is_requested():
    values = [synthetic.character(), synthetic.animation(), synthetic.result(), OutputPaths()]
    with pytest.raises(PluginError, match="--video"):
        run_operator(host_with(PLUGIN), "video.write", values)


def test_slow_changes_are_not_left_out_for_long(tmp_path, video):
    across = np.arange(96)

    def draw(number):  # a shade that moves by less between two frames than what the encoder takes for a difference
        shade = 128.0 + 90.0 * np.sin(2.0 * np.pi * (across - 0.5 * number) / 96.0)
        return Image.fromarray(np.repeat(np.tile(shade.astype(np.uint8), (64, 1))[:, :, None], 3, axis=2))

    quality, count = 60, 40
    video.encoding.encode(str(tmp_path / "shade.webp"), map(draw, range(count)), count, 25.0, quality)
    with Image.open(tmp_path / "shade.webp") as shown:
        shown.seek(shown.n_frames - 1)  # frames that differ in nothing are one
        off = np.abs(np.asarray(shown.convert("RGB"), dtype=int) - np.asarray(draw(count - 1), dtype=int))
    assert np.quantile(off, 0.99) < 3 * video.encoding.unseen_levels(quality)
