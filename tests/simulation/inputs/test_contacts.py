"""Contacts on a time grid, and what shots with contacts are not combined with."""

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.animation import Contact
from calmotion.simulation.inputs.contacts import active_steps
from calmotion.simulation.inputs.time_grid import make_grid
from steppers import ROBOT, write_stepper


def test_a_contact_holds_in_the_steps_that_begin_while_it_is_active():
    grid = make_grid(np.arange(5) / 24.0, 1 / 48, 1 / 24)
    contact = Contact(np.array([0.0, 1 / 24, 3 / 24]), np.array([True, False, True]))
    # two steps of pre-roll, then two a frame: row n is about the step to instant n
    assert active_steps(contact, grid).tolist() == [True] * 5 + [False] * 4 + [True] * 2


def setting(name, value):
    def edit(stage):
        prim = stage.GetPrimAtPath(ROBOT)
        prim.ApplyAPI("CalmRetargetAPI")
        prim.GetAttribute(name).Set(value)

    return edit


def in_the_air(stage):
    stage.GetPrimAtPath(f"{ROBOT}/left/Foot/Sole").GetAttribute("calm:contact:active").Clear()
    stage.GetPrimAtPath(f"{ROBOT}/left/Foot/Sole").GetAttribute("calm:contact:active").Set(False)


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (setting("calm:retarget:cyclic", True), "calm:retarget:cyclic"),
        (setting("calm:retarget:reference", "static"), "calm:retarget:reference"),
        (in_the_air, "nothing holds the robot at the first frame"),
    ],
)
def test_what_contacts_do_not_support_is_refused(tmp_path, edit, words):
    shot = cm.open_shot(write_stepper(tmp_path / "stepper.usda", edit))
    with pytest.raises(ShotError, match=words):
        cm.simulate(shot, step=1 / 48)


def test_other_integrators_are_refused(tmp_path):
    shot = cm.open_shot(write_stepper(tmp_path / "stepper.usda"))
    with pytest.raises(ShotError, match="only bdf2 simulates contacts"):
        cm.simulate(shot, step=1 / 48, integrator="newmark")
