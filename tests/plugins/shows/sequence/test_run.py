"""A repertoire: clips and all transitions, joined at rest, checked, in a table; only what has changed is made again."""

import json
from pathlib import Path

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.curves import held_curve
from calmotion.workflow.shot import Shot
from calmotion_plugins.shows.sequence.run import Repertoire, sequence
from repertoires import member
from small_shots import ELBOW, FRAMES, HAND, SHOULDER, TARGET_POSITION, make_flexible, make_target, write_arm

ARGUMENTS = ("--tolerance=0.002m", "--step=0.008s")


def write_clip(path, first, last):
    """The flexible arm, from one pose of both motors to another [deg]."""

    def edit(stage):
        make_flexible(stage)
        make_target(stage, HAND, positionWeight=1.0)
        s = np.clip((np.arange(FRAMES + 1) - 4) / (FRAMES - 8), 0.0, 1.0)
        rise = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        for joint, start, end in ((SHOULDER, first, last), (ELBOW, 2.0 * first, last)):
            attribute = stage.GetPrimAtPath(joint).GetAttribute(TARGET_POSITION)
            attribute.Clear()
            for frame, value in enumerate(start + rise * (end - start)):
                attribute.Set(float(value), frame)

    return write_arm(path, edit)


@pytest.fixture
def plan_file(tmp_path):
    write_clip(tmp_path / "up.usda", 0.0, 20.0)
    write_clip(tmp_path / "down.usda", 10.0, -5.0)
    (tmp_path / "clips.toml").write_text('[clips]\nup = "up.usda"\ndown = "down.usda"\n')
    return tmp_path / "clips.toml"


@pytest.mark.long
def test_every_clip_may_follow_every_other_one(plan_file, tmp_path, calmotion):
    folder = tmp_path / "out"
    made = sequence(plan_file, folder, arguments=ARGUMENTS, workers=2)
    assert made.good
    assert [m.name for m in made.clips] == ["up", "down"] and [m.name for m in made.transitions] == [
        "up_to_down", "down_to_up",
    ]  # fmt: skip
    ends = {}
    for one in (*made.clips, *made.transitions):
        assert one.outcome == "done" and one.error_m <= 2e-3 and Path(one.layer).exists()
        animation = Shot(f"{Path(one.layer).with_suffix('')}_root.usda").read().animation
        assert animation.frame_times[-1] == pytest.approx(one.seconds)
        span = np.array([0.0, one.seconds])
        ends[one.name] = np.array([held_curve(track, span[1])(span, 0) for track in animation.current]).T
    for name, (one, two) in {"up_to_down": ("up", "down"), "down_to_up": ("down", "up")}.items():
        np.testing.assert_allclose(ends[name][0], ends[one][1], atol=1e-6)
        np.testing.assert_allclose(ends[name][1], ends[two][0], atol=1e-6)
    report = json.loads((folder / "sequence.json").read_text())
    assert report["good"] and len(report["transitions"]) == 2
    again = calmotion(
        "sequence", plan_file, "-o", folder, "--tolerance", "2mm", "--step", "8ms", "--workers", "2", "--json"
    )
    rows = json.loads(again.stdout)
    assert again.returncode == 0 and {row["outcome"] for row in (*rows["clips"], *rows["transitions"])} == {"kept"}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"within_tolerance": False}, "no: tolerance missed"),
        ({"within_goal": False}, "no: error above the goal"),
        ({"exceeded_limits": ("/Arm/elbow velocity",)}, "no: exceeds /Arm/elbow velocity"),
        ({"joined": False}, "no: ends changed"),
        ({"error_m": None, "outcome": "failed", "layer": None}, "no"),
    ],
)
def test_a_transition_that_may_not_be_played_is_marked(change, told):
    clips = [member("a", "a", "a"), member("b", "b", "b")]
    pairs = [member("a_to_b", "a", "b"), member("b_to_a", "b", "a")]
    assert Repertoire("out", clips, pairs, 1.0).good
    made = Repertoire("out", clips, [pairs[0], member("b_to_a", "b", "a", **change)], 1.0)
    report = made.report()
    assert report["good"] is False and "Not every clip" in report["verdict"]
    assert [row["may_be_played"] for row in report["transitions"]] == ["yes", told]


def test_robots_that_are_not_animated_by_drives_are_refused(plan_file, tmp_path, repository):
    dancer = repository / "samples" / "dancer" / "dancer.usda"
    (tmp_path / "other.usda").write_text(f"#usda 1.0\n(\n    subLayers = [@{dancer}@]\n)\n")
    plan_file.write_text(f'[clips]\na = "{dancer}"\nb = "{dancer}"\n')
    with pytest.raises(ShotError, match="animated otherwise|at rest"):
        sequence(plan_file, tmp_path / "out")
