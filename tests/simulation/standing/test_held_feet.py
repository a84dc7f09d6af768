"""What the ground does to feet while they are held, from the motion of a walking robot."""

import calmotion as cm
import numpy as np
import pytest
from calmotion.model import Body, Frame, SurfaceMesh
from calmotion.simulation.standing.held_feet import (
    centres_of_pressure,
    held_feet,
    margins,
    points_of,
    sole_of,
    unlike_ground,
)
from steppers import ROBOT, STRIDE, walk, write_stepper


def feet_of(path, **options):
    result = cm.simulate(path, step=1 / 96, **options)
    character = result.shot.character
    return character, held_feet(character, result.result.before.motion)


def test_feet_of_a_slow_walk_stand(tmp_path):
    character, (left, right) = feet_of(write_stepper(tmp_path / "stepper.usda"))
    assert [character.joints[foot.joint].path for foot in (left, right)] == [
        f"{ROBOT}/left/Foot/Sole", f"{ROBOT}/right/Foot/Sole"
    ]  # fmt: skip
    assert (left.start, left.end, right.start, right.end) == pytest.approx((0.0, 0.5, 0.5, 1.0))
    weight = 9.81 * sum(body.mass.mass for body in character.bodies)
    assert left.force == pytest.approx(weight, rel=0.1) and left.normal[0] == pytest.approx(weight, rel=0.1)
    # the weight is over the middle between the feet, 5 cm from the middle of soles 30 cm wide, and swings
    assert 0.05 < left.margin[0] < 0.1 and left.slip < 1e-9 and left.landing_speed is None
    assert right.landing_speed < 0.01 and right.impulse < 0.05
    assert unlike_ground(character, left) == unlike_ground(character, right) == []


def test_narrow_soles_tip_and_slippery_ones_slip(tmp_path):
    def slippery(stage):
        stage.GetPrimAtPath(f"{ROBOT}/left/Foot/Sole").GetAttribute("calm:contact:friction").Set(0.01)

    character, (left, right) = feet_of(write_stepper(tmp_path / "stepper.usda", slippery, width=0.08))
    assert left.margin[0] == pytest.approx(-0.01, abs=6e-3)
    assert left.friction[0] > 0.01 and unlike_ground(character, left) == ["tips", "slips"]
    assert unlike_ground(character, right) == ["tips"]


def test_a_jerk_upwards_pulls_at_the_ground(tmp_path):
    def jump(frames):
        # both feet drop below the torso and come back: the standing leg throws the robot up, and stops it
        torso, feet = walk(frames, 0.0, 0.0)
        s = np.sin(np.pi * np.clip(np.asarray(frames) / 8.0, 0.0, 1.0)) ** 3
        return torso, {side: (x, height - 0.15 * s) for side, (x, height) in feet.items()}

    character, (left, _) = feet_of(write_stepper(tmp_path / "stepper.usda", walking=jump))
    assert left.normal[0] < 0.0 and "pulls" in unlike_ground(character, left)


def test_a_stamp_has_an_impulse(tmp_path):
    def stamp(frames):
        torso, feet = walk(frames)
        s = np.clip(2.0 * np.asarray(frames) / 24.0, 0.0, 1.0)
        feet["right"] = (STRIDE * s, 0.12 * s * (1.0 - s))
        return torso, feet

    _, (left, right) = feet_of(write_stepper(tmp_path / "stepper.usda", walking=stamp))
    assert right.landing_speed > 0.1 and right.impulse > 0.1


def test_the_command_tells_and_refuses_when_strict(tmp_path, calmotion):
    path = write_stepper(tmp_path / "stepper.usda", width=0.08)
    done = calmotion("simulate", path, "--step", "10ms", "--strict")
    assert done.returncode == 1 and "Feet on the ground" in done.stdout
    assert f"{ROBOT}/left/Foot/Sole: the foot would tip over" in " ".join(done.stdout.split())


UP = np.array([0.0, 0.0, 1.0])
CORNERS = np.array([[x, y, z] for z in (0.0, 0.3) for y in (-0.05, 0.05) for x in (-0.1, 0.1)])


def test_the_sole_is_what_lies_lowest():
    sole, ground = sole_of(CORNERS + [1.0, 2.0, 0.5], UP)
    np.testing.assert_allclose(sole, CORNERS[:4] + [1.0, 2.0, 0.5])
    assert ground == 0.5


def test_margins_are_distances_to_the_outline():
    places = np.array([[0.0, 0.0, 0.0], [0.08, 0.0, 7.0], [0.0, 0.07, 0.0]])
    np.testing.assert_allclose(margins(CORNERS[:4], places, UP), [0.05, 0.02, -0.02])
    assert margins(CORNERS[:2], places, UP) is None
    assert margins(CORNERS[:2].repeat(2, axis=0), places, UP) is None


def test_a_force_at_a_place_has_its_centre_of_pressure_there():
    rng = np.random.default_rng(1)
    there, at = np.array([0.3, -0.2, 0.1]), rng.normal(size=(5, 3))
    forces = rng.normal(size=(5, 3)) + [0.0, 0.0, 9.0]
    moments = np.cross(there - at, forces) + [0.0, 0.0, 0.4]  # and a turn about the vertical
    np.testing.assert_allclose(centres_of_pressure(forces, moments, at, UP, 0.1), np.tile(there, (5, 1)), atol=1e-12)


def test_points_are_those_that_are_drawn():
    shown, hidden = (SurfaceMesh("/Foot/a", CORNERS, np.zeros((0, 3), np.int32), None, seen) for seen in (True, False))
    pose = Frame(np.array([1.0, 0.0, 0.0]), np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]))
    found = points_of(Body("/Foot", pose, None, (shown, hidden)), pose)
    np.testing.assert_allclose(found[0], [1.05, -0.1, 0.0], atol=1e-12)
    assert len(found) == 8 and len(points_of(Body("/Foot", pose, None), pose)) == 0
