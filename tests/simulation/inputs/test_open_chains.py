"""Motors that contradict each other in a closed chain while the shot goes on."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import (
    WORLD,
    Animation,
    Body,
    Character,
    ElasticMaterial,
    FlexibleSettings,
    Frame,
    Joint,
    MassProperties,
    Motor,
    Target,
    Track,
)
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.tolerance.simplification.analysis import analyse
from calmotion.tolerance.simulation import simulate_to_tolerance
from posed import ignore_progress

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
FRAMES = np.arange(25) / 24.0
PLACES = np.array([[0.0, 0.0, 0.0], [0.0, 0.8, 0.0], [1.1, 1.0, 0.0], [1.3, 0.0, 0.0]])
ENDS = [(WORLD, 0), (0, 1), (1, 2), (WORLD, 2)]
NAMES = ["/Bar/crank", "/Bar/left", "/Bar/right", "/Bar/rocker"]


def four_bar(driven):
    """A four-bar linkage in the plane z = 0, whose bodies have their frames at the origin."""

    def at(position):
        return Frame(np.array(position, float), UPRIGHT)

    bodies = tuple(
        Body(f"/Bar/link{k}", at([0, 0, 0]), MassProperties(1.0, PLACES[k : k + 2].mean(axis=0), 0.01 * np.eye(3)))
        for k in range(3)
    )
    joints = tuple(
        Joint(name, "revolute", *ends, at(place), at(place))
        for name, ends, place in zip(NAMES, ENDS, PLACES, strict=True)
    )
    motors = tuple(Motor(joint=k, path=NAMES[k], attribute="drive:angular:physics:targetPosition") for k in driven)
    targets = (Target("/Bar/link1", 1, at(PLACES[2])),)
    return Character("/Bar", bodies, joints, motors, targets, np.array([0.0, -9.81, 0.0]))


def drift(begin, by):
    """A track that leaves zero at a time."""
    values = by * np.clip((FRAMES - begin) / 0.2, 0.0, 1.0) ** 2
    return Track(FRAMES, values, FRAMES[FRAMES == begin])


def shot_of(driven, tracks):
    return compile_shot(four_bar(driven), Animation(FRAMES, tracks, tracks))


OPTIONS = RunSettings(step=1 / 240, tolerance=1e-3)


@pytest.mark.parametrize("run", [simulate_shot, optimize_shot])
@pytest.mark.parametrize(
    ("driven", "begin", "by"),
    [((0, 3), 0.5, 0.3), ((0, 3), 0.25, -0.02), ((0, 1), 0.5, 0.3), ((0, 3), 0.5, 2.5), ((0, 1), 0.5, -2.0)],
)
def test_the_joint_the_motors_and_the_time_are_named(run, driven, begin, by):
    tracks = (drift(2.0, 0.0), drift(begin, by))
    with pytest.raises(ShotError) as error:
        run(shot_of(driven, tracks), OPTIONS, ignore_progress)
    assert error.value.path in NAMES
    assert all(NAMES[k] in error.value.remedy for k in driven), error.value.message()
    time = float(error.value.problem.split(" s on")[0].rpartition(" ")[2])
    assert begin < time < begin + 0.15
    assert not isinstance(error.value, IntegrationError)


def test_gaps_below_a_millimetre_of_the_first_pose_are_refused_with_their_joint():
    tracks = (drift(2.0, 0.0), Track(FRAMES, np.full(len(FRAMES), 6e-4)))
    with pytest.raises(ShotError, match=r"stays open by 0\.\d+ mm") as error:
        simulate_shot(shot_of((0, 3), tracks), OPTIONS, ignore_progress)
    assert error.value.path in NAMES and NAMES[0] in error.value.remedy


def test_motors_that_agree_are_simulated():
    result = simulate_shot(shot_of((0,), (drift(0.5, 0.3),)), OPTIONS, ignore_progress)
    assert result.before.max_joint_gap < 1e-6


@pytest.mark.parametrize("by", [0.03, 0.1])
def test_no_integrator_hides_them(by):
    tracks = (drift(2.0, 0.0), drift(0.5, by))
    with pytest.raises(ShotError, match="from 0.5.. s on") as error:
        simulate_to_tolerance(shot_of((0, 3), tracks), RunSettings(tolerance=1e-3), ignore_progress)
    assert error.value.path in NAMES


def test_numbers_beyond_all_bounds_are_no_traceback():
    tracks = (drift(2.0, 0.0), drift(0.5, 2.5))
    with pytest.raises(IntegrationError) as error:
        simulate_shot(shot_of((0, 3), tracks), replace(OPTIONS, integrator="generalized-alpha"), ignore_progress)
    assert error.value.path and error.value.remedy
    time = float(error.value.problem.partition(" at ")[2].split(" s")[0])
    assert 0.5 < time < 0.75


def flexible(character, *links):
    """The linkage with flexible links, as far as the analysis sees them."""
    settings = FlexibleSettings(ElasticMaterial("/Bar/Steel", 2e11, 0.3, 8000.0))
    bodies = tuple(replace(body, flexible=settings if k in links else None) for k, body in enumerate(character.bodies))
    return replace(character, bodies=bodies)


def analysed(character, tracks, **options):
    return analyse(character, Animation(FRAMES, tracks, tracks), RunSettings(tolerance=1e-3, **options), {}, False)


@pytest.mark.parametrize("links", [(), (1,)])
@pytest.mark.parametrize(
    ("driven", "begin", "by"), [((0, 3), 0.5, 0.3), ((0, 1), 0.25, -0.2), ((0, 3), 0.5, 2.5), ((0, 1, 2, 3), 0.5, 0.3)]
)
def test_the_analysis_refuses_them_before_anything_is_meshed(driven, begin, by, links):
    tracks = (*[drift(2.0, 0.0)] * (len(driven) - 1), drift(begin, by))
    with pytest.raises(ShotError) as error:
        analysed(flexible(four_bar(driven), *links), tracks)
    assert error.value.path in NAMES
    assert all(NAMES[k] in error.value.remedy for k in driven), error.value.message()
    time = float(error.value.problem.split(" s on")[0].rpartition(" ")[2])
    assert begin < time < begin + 0.15


@pytest.mark.parametrize("by", [6e-4, 0.02, 1.0, 3.0])
def test_the_analysis_refuses_them_in_the_first_pose(by):
    tracks = (drift(2.0, 0.0), Track(FRAMES, np.full(len(FRAMES), by)))
    with pytest.raises(ShotError, match="stays open by") as error:
        analysed(four_bar((0, 3)), tracks)
    assert error.value.path in NAMES and NAMES[0] in error.value.remedy and NAMES[3] in error.value.remedy


def test_the_analysis_leaves_small_gaps_to_bodies_that_give_way():
    tracks = (drift(2.0, 0.0), drift(0.5, 6e-4))
    with pytest.raises(ShotError, match="from 0.5"):
        analysed(four_bar((0, 3)), tracks)
    assert analysed(flexible(four_bar((0, 3)), 1), tracks).rows
    with pytest.raises(ShotError, match="from 0.5"):
        analysed(flexible(four_bar((0, 3)), 1), (drift(2.0, 0.0), drift(0.5, 6e-3)))


def test_a_crank_that_turns_through_is_analysed():
    whole = Track(FRAMES, np.linspace(0.0, 0.9, len(FRAMES)) ** 2)
    assert analysed(four_bar((0,)), (whole,)).rows


def test_a_single_motor_is_not_said_to_contradict_others():
    tracks = (drift(0.25, 57.3 * 0.3),)
    with pytest.raises(ShotError, match="do not meet") as error:
        analysed(four_bar((0,)), tracks)
    assert "cannot reach" in error.value.remedy and "one of them" not in error.value.remedy
    assert NAMES[0] in error.value.remedy and "degrees in a shot" in error.value.remedy
