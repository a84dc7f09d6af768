"""Which joints share a patch, and the balls that patches keep to."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.mesh.patches.interface_patches import AttachmentFrame, at_one_place
from calmotion.mesh.patches.joint_places import balls_between, nearest_apart, reached_by, within
from calmotion.mesh.tetrahedra import boundary_triangles
from calmotion.model import InterfaceSurface

PLACES = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.05, 0.01], [1e-6, 0.0, 0.0]])


def test_balls_contain_the_points_that_are_nearer_by_a_factor():
    points = np.random.default_rng(3).uniform(-0.06, 0.06, (4000, 3))
    distance = np.linalg.norm(points[:, None] - PLACES[None], axis=2)
    balls = balls_between(PLACES, 0, 1e-4)
    expected = distance[:, 0] <= 0.45 / 0.55 * distance[:, 1:3].min(axis=1)  # the last place is the same one
    assert len(balls) == 2 and np.array_equal(within(points, balls), expected) and 100 < expected.sum() < 3900
    # from the own place towards the other, as far as the largest patch
    assert within(np.array([[0.0089, 0, 0]]), balls).all() and not within(np.array([[0.0091, 0, 0]]), balls).any()


def test_balls_that_contain_the_sphere_of_a_patch_are_left_out():
    balls = balls_between(PLACES, 0, 1e-4)
    assert reached_by(balls, PLACES[0], 0.0089) == () and reached_by(balls, PLACES[0], 0.0091) == (balls[0],)
    assert reached_by(balls, PLACES[0], 0.03) == tuple(balls)


@pytest.fixture
def attachments(helpers):
    return [AttachmentFrame(f"/{k}", helpers.frame(*position), "interface") for k, position in enumerate(PLACES)]


SUBSET = InterfaceSurface("/s", "/n", np.zeros((1, 3, 3)))


def test_joints_nearer_than_that_are_at_one_place_unless_their_surfaces_are_named(helpers, attachments):
    assert at_one_place(attachments, 1e-5) == [[0, 3], [1], [2]]
    assert at_one_place(attachments, 0.03) == [[0, 1, 3], [2]]
    target = AttachmentFrame("/t", helpers.frame(0, 0, 0), "point")
    named = AttachmentFrame("/n", helpers.frame(0, 0, 0), "interface", SUBSET)
    assert at_one_place([target, named, *attachments], 0.03) == [[1], [2, 3, 5], [4]]


def test_slender_bodies_tell_near_joints_apart_and_stout_ones_do_not(helpers):
    def apart(length, radius=-1.0):
        points, tets = helpers.box((4, 1, 1), (length, 0.02, 0.02))
        return nearest_apart(points[boundary_triangles(tets)], radius)

    assert 0.002 < apart(0.6) < 0.003  # an eighth of the width
    assert apart(0.02) == pytest.approx(0.05 / 0.45 * 0.02 * np.sqrt(3.0))
    assert apart(0.6, radius=0.01) == pytest.approx(1e-6 * 0.6, rel=0.01)
