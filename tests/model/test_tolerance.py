"""The tolerance of a shot, and the reach that its default is a share of."""

import dataclasses

import calmotion as cm
import numpy as np
import pytest
from calmotion.model import Body, Character, Frame, Joint, RetargetSettings, Target
from calmotion.model.tolerance import (
    MEASURED,
    MESH,
    REDUCTION,
    SEARCH,
    SMALLEST,
    STEP,
    BudgetEntry,
    reach,
    tolerance_of,
    verdict_on,
)
from steppers import write_stepper

NO_TURN = np.array([1.0, 0.0, 0.0, 0.0])


def frame(x=0.0, y=0.0, z=0.0):
    return Frame(np.array([x, y, z]), NO_TURN)


def robot(joints, targets, bodies=3):
    return Character(
        "/R",
        tuple(Body(f"/R/B{k}", frame(), None) for k in range(bodies)),
        tuple(Joint(f"/R/J{k}", *joint) for k, joint in enumerate(joints)),
        (),
        tuple(Target(f"/R/T{k}", *target) for k, target in enumerate(targets)),
        np.zeros(3),
    )


CHAIN = [
    ("revolute", -1, 0, frame(5.0), frame(0.1)),
    ("revolute", 0, 1, frame(0.4), frame()),
    ("revolute", 1, 2, frame(0.0, 0.5), frame(0.0, 0.0, 0.2)),
]


@pytest.mark.parametrize(
    ("joints", "targets", "expected"),
    [
        (CHAIN, [(2, frame(0.0, 0.0, 1.2))], 0.3 + 0.5 + 1.0),
        (CHAIN, [(2, frame(0.0, 0.0, 1.2)), (0, frame(3.1))], 3.0),
        (CHAIN, [], 0.3 + 0.5),
        # a joint that names its bodies the other way round
        ([CHAIN[0], ("revolute", 1, 0, frame(), frame(0.4)), CHAIN[2]], [(2, frame(0.0, 0.0, 1.2))], 1.8),
        # a slider reaches farther by its travel, where that has an end
        ([CHAIN[0], ("prismatic", 0, 1, frame(0.4), frame(), -0.5, 1.5)], [(1, frame(0.0, 0.5))], 0.3 + 2.0 + 0.5),
        ([CHAIN[0], ("prismatic", 0, 1, frame(0.4), frame())], [(1, frame(0.0, 0.5))], 0.3 + 0.5),
        # a joint that closes a chain is no way round
        (CHAIN + [("revolute", 0, 2, frame(9.0), frame(), -1.0, 1.0, True)], [(2, frame(0.0, 0.0, 1.2))], 1.8),
        # a floating base begins at its origin
        ([("revolute", 0, 1, frame(0.4), frame())], [(1, frame(0.0, 0.5))], 0.9),
    ],
)
def test_the_reach_is_the_longest_chain_to_a_target(joints, targets, expected):
    assert reach(robot(joints, targets)) == pytest.approx(expected, rel=1e-12)


def test_the_users_tolerance_is_before_that_of_the_shot_and_before_a_thousandth_of_the_reach():
    character = robot(CHAIN, [(2, frame(0.0, 0.0, 1.2))])
    assert tolerance_of(character) == pytest.approx(1.8e-3)
    settled = dataclasses.replace(character, retarget=RetargetSettings(tolerance=5e-4))
    assert tolerance_of(settled) == 5e-4 and tolerance_of(settled, 2e-3) == 2e-3
    assert tolerance_of(robot([], [], 1)) == SMALLEST


def test_a_robot_that_stands_on_its_feet_reaches_from_them(tmp_path):
    shot = cm.open_shot(write_stepper(tmp_path / "stepper.usda"))
    # 4 cm of sole, 0.66 m of leg, 10 cm to the middle of the torso, 20 cm to the head, and the way between the axes
    assert 1.0 < reach(shot.character) < 1.1


def budget(**estimates):
    """An entry for each estimate, in thousandths of the tolerance; each may cost half of it."""
    sources = {"mesh": MESH, "step": STEP, "reduction": REDUCTION, "search": SEARCH}
    return [
        BudgetEntry(sources[name], 0.5, None if value is None else value / 1000.0, "", "")
        for name, value in estimates.items()
    ]


@pytest.mark.parametrize(
    ("estimates", "measured", "kept", "error", "short"),
    [
        ({"step": 300, "mesh": 400}, None, True, 0.7, ""),
        ({"step": 300, "mesh": 900}, None, False, 1.2, MESH),
        ({"step": 900, "mesh": 300}, None, False, 1.2, STEP),
        ({"step": 400, "reduction": 300, "mesh": 400}, None, False, 1.1, STEP),
        ({"step": 900, "mesh": 300}, 0.1, True, 0.1, ""),
        ({"step": 100, "mesh": 300}, 1.5, False, 1.5, MEASURED),
        ({"step": 100, "mesh": 1900}, 0.1, True, 0.1, ""),
        ({"step": 100, "mesh": None}, None, True, 0.1, ""),
        ({"step": 100, "search": 5000}, None, True, 0.1, ""),
        ({}, 0.5, True, 0.5, ""),
        ({}, 1.5, False, 1.5, MEASURED),
    ],
)
def test_errors_add_up_and_a_measured_one_replaces_them(estimates, measured, kept, error, short):
    verdict = verdict_on(budget(**estimates), 1.0, measured)
    assert (verdict.kept, verdict.short) == (kept, short) and verdict.error_m == pytest.approx(error)


def test_what_was_not_estimated_is_not_called_kept():
    verdict = verdict_on([], 1.0)
    assert not verdict.kept and verdict.error_m is None and verdict.short == ""
