"""Soles and centres of pressure."""

from __future__ import annotations

import numpy as np
from calmotion.model import Body, Frame, SurfaceMesh
from calmotion.simulation.standing.held_feet import centres_of_pressure, margins, points_of, sole_of

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
