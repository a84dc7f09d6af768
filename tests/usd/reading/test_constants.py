"""Masses that are animated: one sample is the value, and of samples that differ a note says which is used."""

import pytest
import small_shots as shots
from calmotion.usd.reading import read_shot

MASS = "physics:mass"


def arm(folder, *samples, default=None):
    def edit(stage):
        attribute = stage.GetPrimAtPath(shots.FORE).GetAttribute(MASS)
        attribute.Clear()
        if default is not None:
            attribute.Set(default)
        for code, value in samples:
            attribute.Set(value, code)

    character, _, _ = read_shot(str(shots.write_arm(folder / "shot.usda", edit)))
    (body,) = [body for body in character.bodies if body.path == shots.FORE]
    return body.mass.mass, [note for note in character.notes if MASS in note]


def test_a_single_sample_is_the_value(tmp_path):
    assert arm(tmp_path, (7.0, 0.75)) == (pytest.approx(0.75), [])


@pytest.mark.parametrize(("default", "used"), [(None, 0.75), (2.0, 2.0)])
def test_samples_that_differ_are_told_with_the_value_that_is_used(tmp_path, default, used):
    mass, notes = arm(tmp_path, (0.0, 0.75), (12.0, 3.0), default=default)
    assert mass == pytest.approx(used)
    (note,) = notes
    assert note.startswith(f"{shots.FORE}.{MASS}: it is animated") and f"{used} is used" in note
