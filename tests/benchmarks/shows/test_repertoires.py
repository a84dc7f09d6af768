"""Clips that are cut out of shots: they begin and end at rest, and follow one another."""

import json

import numpy as np
import pytest
from calmotion.benchmarks.shows import repertoires
from calmotion.benchmarks.shows.repertoires import clip_of, write_clips
from calmotion.errors import ShotError
from calmotion.shot.curves import held_curve
from calmotion.workflow.sequence.clips import read_clips, read_plan
from calmotion.workflow.shot import Shot
from one_hinge import ONE_HINGE


@pytest.fixture
def shot(tmp_path):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    return Shot(tmp_path / "shot.usda").read()


def test_a_clip_has_the_poses_of_its_part_and_rests_at_its_ends(shot):
    times, values = clip_of(shot, 0.2, 0.5)
    curve = held_curve(shot.animation.tracks[0], shot.animation.frame_times[-1])
    np.testing.assert_allclose(values[[0, -1], 0], curve(np.array([0.2, 0.7]), 0))
    steps = np.abs(np.diff(values[:, 0]))
    frame = shot.animation.frame_times[1]
    assert times[-1] == pytest.approx(0.5 + 4.0 * frame, abs=frame)
    assert np.all(steps[[0, 1, -2, -1]] < 1e-12) and steps.max() > 0.0


def test_clips_of_two_shots_are_listed(shot, tmp_path):
    clips = read_clips(read_plan(write_clips([shot, shot], 3, 0.5, tmp_path)))
    assert [clip.name for clip in clips] == ["a0", "a1", "b0"]


def test_more_than_a_shot_has_is_refused(shot, tmp_path):
    with pytest.raises(ShotError, match="too short"):
        write_clips([shot], 20, 5.0, tmp_path)


@pytest.mark.long
def test_one_command_makes_clips_and_all_transitions(shot, capsys):
    status = repertoires.main([shot.path, "--clips=2", "--seconds=0.5", "--tolerance=20mm", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert len(found["clips"]) == 2 and len(found["transitions"]) == 2 and status == (0 if found["good"] else 1)
    assert found["processor_s"] > 0.0
