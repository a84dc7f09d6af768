"""Clips of a repertoire: what a file says, what may follow what, and motions between poses within limits."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion_plugins.shows.sequence.clips import pace_of, read_clips, read_plan, transition
from one_hinge import HINGE, ONE_HINGE, TIP

FREE = "calm:motor:optimize"
MOTOR = '(prepend apiSchemas = ["PhysicsDriveAPI:angular"])\n    {'
MOTORS = '(prepend apiSchemas = ["PhysicsDriveAPI:angular", "CalmMotorAPI"])\n    {'
PLACE = "            double3 xformOp:translate = (0.1, 0, 0)\n"


def clip_text(first, last):
    frames = np.arange(25)
    s = np.clip((frames - 4) / 16.0, 0.0, 1.0)
    values = first + (last - first) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    samples = ", ".join(f"{frame}: {float(value)!r}" for frame, value in zip(frames, values, strict=True))
    return ONE_HINGE.replace("0: 0, 6: 10, 12: 30, 18: 20, 24: 0", samples)


@pytest.fixture
def plan_file(tmp_path):
    (tmp_path / "a.usda").write_text(clip_text(0.0, 30.0))
    (tmp_path / "b.usda").write_text(clip_text(-20.0, 5.0))
    path = tmp_path / "clips.toml"
    path.write_text('shortest_transition = "400ms"\n[clips]\nwave = "a.usda"\nnod = "b.usda"\n')
    return path


def test_a_file_names_clips_beside_it(plan_file, tmp_path):
    plan = read_plan(plan_file)
    assert plan.clips == {"wave": str(tmp_path / "a.usda"), "nod": str(tmp_path / "b.usda")}
    assert plan.reference == "static" and plan.shortest == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("[clips", "cannot be read"),
        ('[clips]\none = "a.usda"\n', "no two clips"),
        ('[clips]\n"a/b" = "a.usda"\nc = "b.usda"\n', "no name of files"),
        ('pose = 1\n[clips]\na = "a.usda"\nb = "b.usda"\n', "no such key"),
        ('reference = "soft"\n[clips]\na = "a.usda"\nb = "b.usda"\n', "no reference"),
        ('shortest_transition = "fast"\n[clips]\na = "a.usda"\nb = "b.usda"\n', "no time"),
        ('shortest_transition = -1\n[clips]\na = "a.usda"\nb = "b.usda"\n', "out of range"),
    ],
)
def test_a_file_that_is_no_list_of_clips_is_refused(tmp_path, text, place):
    (tmp_path / "clips.toml").write_text(text)
    with pytest.raises(ShotError, match=place) as error:
        read_plan(tmp_path / "clips.toml")
    assert error.value.remedy and error.value.path.endswith("clips.toml")


def test_transitions_lead_from_pose_to_pose_at_rest_within_limits(plan_file):
    clips = read_clips(read_plan(plan_file))
    wave, nod = clips
    assert np.degrees([wave.end[0], nod.start[0]]) == pytest.approx([30.0, -20.0])
    pace = pace_of(clips, wave.shot.character)
    assert pace[0][0] == pytest.approx(0.9 * max(wave.rates[0], nod.rates[0]))
    for shortest in (0.1, 3.0):
        times, values = transition(wave, nod, pace, shortest)
        assert values[0] == pytest.approx(wave.end) and values[-1] == pytest.approx(nod.start)
        assert np.all(np.diff(times) == pytest.approx(1 / 24)) and times[-1] >= shortest
        np.testing.assert_array_equal(values[:3], np.tile(values[0], (3, 1)))
        assert np.abs(np.diff(values, axis=0)).max() * 24.0 <= pace[0][0] * (1.0 + 1e-9)
        assert np.abs(np.diff(values, 2, axis=0)).max() * 24.0**2 <= pace[1][0] * (1.0 + 1e-9)


def test_a_motor_that_is_still_everywhere_needs_limits(plan_file):
    wave, nod = read_clips(read_plan(plan_file))
    with pytest.raises(ShotError, match="moves in no clip") as error:
        transition(wave, nod, (np.zeros(1), np.zeros(1)), 0.5)
    assert error.value.path == HINGE


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda text: text.replace("22: 5.0, 23: 5.0, 24: 5.0", "22: 6.0, 23: 7.0, 24: 8.0"), "does not end at rest"),
        (
            lambda text: text.replace("0: -20.0, 1: -20.0, 2: -20.0", "0: -23.0, 1: -22.0, 2: -21.0"),
            "does not begin at rest",
        ),
        (lambda text: text.replace('"Robot"', '"Other"').replace("/Robot", "/Other"), "different robots"),
    ],
)
def test_clips_that_cannot_follow_one_another_are_refused(plan_file, change, problem):
    path = plan_file.with_name("b.usda")
    text = change(path.read_text())
    assert text != path.read_text()
    path.write_text(text)
    with pytest.raises(ShotError, match=problem) as error:
        read_clips(read_plan(plan_file))
    assert error.value.path.endswith("b.usda") and error.value.remedy


SERVO = """
        float drive:angular:physics:stiffness = 500
        float drive:angular:physics:damping = 5
        uniform token calm:motor:model = "servo"
        bool calm:motor:powered.timeSamples = { 0: 1, 12: 0, 14: 1 }
"""
ROOT = """
    def Xform "Base"
    {
        double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 24: (1, 0, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
"""
ON_BASE = "        rel physics:body0 = </Robot/Base>\n"
WEIGHT = "            double calm:target:positionWeight.timeSamples = { 0: 1, 12: 2 }\n"


@pytest.mark.parametrize(
    ("change", "path", "attribute"),
    [
        (lambda t: t.replace(MOTOR, f"{MOTORS}\n        bool {FREE}.timeSamples = {{ 0: 1, 12: 0 }}"), HINGE, FREE),
        (lambda t: t.replace(MOTOR, MOTORS + SERVO), HINGE, "calm:motor:powered"),
        (lambda t: t.replace(PLACE, WEIGHT + PLACE), TIP, "calm:target:positionWeight"),
        (
            lambda t: t.replace(
                '    def PhysicsRevoluteJoint "Hinge"', ROOT + '    def PhysicsRevoluteJoint "Hinge"'
            ).replace("        rel physics:body1", ON_BASE + "        rel physics:body1"),
            HINGE,
            "physics:body0",
        ),
    ],
)
def test_clips_in_which_more_than_motors_is_animated_are_refused(plan_file, change, path, attribute):
    """A transition would have it as at the beginning of the clip that it follows."""
    clip = plan_file.with_name("b.usda")
    text = change(clip.read_text())
    assert text != clip.read_text()
    clip.write_text(text)
    with pytest.raises(ShotError, match="more than motors") as error:
        read_clips(read_plan(plan_file))
    assert (error.value.path, error.value.attribute) == (path, attribute) and error.value.found.endswith("b.usda")
