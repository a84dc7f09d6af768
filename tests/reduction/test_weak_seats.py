"""Joints whose seats decide how stiff a body is: found without a mode more, and told with two frequencies."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.bisection import bisected
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.model import Body, FlexibleSettings, InterfaceSurface
from calmotion.reduction.reduce import reduce_body
from calmotion.reduction.weak_seats import weak_seat_note


@pytest.fixture
def body(helpers, plastic):
    return Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic, mode_count=6))


def joint(helpers, name, *position):
    return AttachmentFrame(name, helpers.frame(*position), "interface")


@pytest.fixture(scope="module")
def block(helpers):
    """A casting with finer elements at the middle of its side."""
    points, tets = helpers.box((8, 6, 5), (0.12, 0.09, 0.07), origin=(-0.06, -0.045, -0.07))
    points = np.asarray(points)
    for _ in range(5):
        points, tets, _ = bisected(points, tets, np.argsort(np.linalg.norm(points[tets].mean(axis=1), axis=1))[:20])
    return helpers.mesh(points, tets)


@pytest.mark.parametrize("ends", [1, 2])
def test_a_block_on_a_small_boss_is_told_with_two_frequencies(helpers, body, block, ends):
    """Nothing of it bends but the ground of its joint, so that its frequency goes with the radius to the power 3/2."""
    at = [joint(helpers, "/Arm/roll", 0.0, 0.0, 0.0), joint(helpers, "/Arm/pitch", 0.06, 0.0, -0.035)][:ends]
    weak = reduce_body(block, body, at, [], 0).weak_seat
    assert weak == 0
    note = weak_seat_note(block, body, at, weak)
    own, half = (float(part.split()[-1]) for part in note.split(" Hz")[:2])
    assert note.startswith("/Arm/link: ") and "/Arm/roll" in note and 2.0 * half < own < 4.0 * half
    # what the shot says is not questioned
    given = replace(body, flexible=replace(body.flexible, interface_radius=0.02))
    named = replace(at[0], surface=InterfaceSurface("/Arm/link/Boss", "/Arm/roll", np.zeros((1, 3, 3))))
    assert weak_seat_note(block, given, at, 0) == "" == weak_seat_note(block, body, [named, *at[1:]], 0)


def test_a_beam_bends_more_than_its_seats_turn(helpers, body):
    beam = helpers.mesh(*helpers.box((20, 2, 2), (0.6, 0.02, 0.02), origin=(0, -0.01, -0.01)))
    at = [joint(helpers, "/Arm/hub", 0.0, 0.0, 0.0), joint(helpers, "/Arm/hand", 0.6, 0.0, 0.0)]
    assert reduce_body(beam, body, at, [], 0).weak_seat is None
    assert reduce_body(beam, body, at[:1], [], 0).weak_seat is None
    assert weak_seat_note(beam, body, at, 0) == ""
