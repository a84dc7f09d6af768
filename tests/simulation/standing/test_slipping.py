"""Feet that cannot stay where they are held."""

import re

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from steppers import LEGS, ROBOT, write_stepper


def both(stage):
    active = stage.GetPrimAtPath(f"{ROBOT}/left/Foot/Sole").GetAttribute("calm:contact:active")
    active.Clear()
    active.Set(True)


def test_feet_that_slide_apart_while_both_are_held_are_refused(tmp_path):
    with pytest.raises(ShotError, match="slips by up to .* while it is held") as error:
        cm.simulate(write_stepper(tmp_path / "stepper.usda", both), step=1 / 48)
    assert "Hold one foot at a time" in str(error.value)


def test_a_robot_on_one_point_falls_over(tmp_path):
    with pytest.raises(ShotError, match="falls over at rest"):
        cm.simulate(write_stepper(tmp_path / "stepper.usda", kind="point"), step=1 / 48)


def standing(stage):
    for side in LEGS:
        active = stage.GetPrimAtPath(f"{ROBOT}/{side}/Foot/Sole").GetAttribute("calm:contact:active")
        active.Clear()
        active.Set(True)


def swaying(apart):
    """The torso sways over both feet, whose key frames have them slide apart [m]."""

    def walking(frames):
        s = np.asarray(frames) / 24.0
        still = np.zeros_like(s)
        feet = {"right": (apart * np.sin(np.pi * s) ** 2, still), "left": (still, still)}
        return 0.05 * np.sin(np.pi * s) ** 2, feet

    return walking


def test_motors_between_two_held_feet_need_not_agree_to_more_than_the_tolerance(tmp_path):
    close = write_stepper(tmp_path / "close.usda", standing, walking=swaying(3e-4))
    rows = cm.simulate(close, step=1 / 48, tolerance="1mm").report()["contacts"]
    assert all(1e-5 < row["slip_m"] < 3e-4 and row["unlike_ground"] == [] for row in rows)
    # what is refused runs with the tolerance that the remedy names
    apart = write_stepper(tmp_path / "apart.usda", standing, walking=swaying(5e-3))
    with pytest.raises(ShotError, match="slips by up to") as error:
        cm.simulate(apart, step=1 / 48, tolerance="1mm")
    found = re.search(r"--tolerance ([0-9.]+mm)", str(error.value))
    assert found is not None and cm.simulate(apart, step=1 / 48, tolerance=found[1]).report()["contacts"]
