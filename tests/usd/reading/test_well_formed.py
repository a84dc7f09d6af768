"""Transforms that USD would not apply, without a word, are refused."""

from calmotion.usd.reading import read_shot
from small_shots import FORE, write_arm


def test_operations_that_stand_still_may_be_left_out(tmp_path):
    def edit(stage):
        stage.GetPrimAtPath(FORE).RemoveProperty("xformOpOrder")

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    assert any("do not meet" in note for note in character.notes)
