"""Transforms that USD would not apply, without a word, are refused."""

import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from posed_shots import posed
from small_shots import FORE, UPPER, write_arm


def test_an_animation_of_bodies_without_an_order_of_operations_is_refused(tmp_path):
    def edit(stage):
        posed(stage)
        for path in (UPPER, FORE):
            stage.GetPrimAtPath(path).RemoveProperty("xformOpOrder")

    with pytest.raises(ShotError, match="does not name the animated") as error:
        read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert (error.value.path, error.value.attribute) == (UPPER, "xformOpOrder") and "xformOp:" in error.value.found


def test_operations_that_stand_still_may_be_left_out(tmp_path):
    def edit(stage):
        stage.GetPrimAtPath(FORE).RemoveProperty("xformOpOrder")

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert any("do not meet" in note for note in character.notes)
