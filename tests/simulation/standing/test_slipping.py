"""Feet that cannot stay where they are held."""

from __future__ import annotations

import calmotion as cm
import pytest
from calmotion.errors import ShotError
from steppers import ROBOT, write_stepper


def both(stage):
    active = stage.GetPrimAtPath(f"{ROBOT}/left/Foot/Sole").GetAttribute("calm:contact:active")
    active.Clear()
    active.Set(True)


def test_feet_that_slide_apart_while_both_are_held_are_refused(tmp_path):
    with pytest.raises(ShotError, match="slips by .* while it is held") as error:
        cm.simulate(write_stepper(tmp_path / "stepper.usda", both), step=1 / 48)
    assert "Hold one foot at a time" in str(error.value)


def test_a_robot_on_one_point_falls_over(tmp_path):
    with pytest.raises(ShotError, match="falls over at rest"):
        cm.simulate(write_stepper(tmp_path / "stepper.usda", kind="point"), step=1 / 48)
