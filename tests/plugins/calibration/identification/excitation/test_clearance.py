"""How near bodies come to each other, on an arm whose upper link carries a bracket along the hand."""

import dataclasses
from itertools import product

import numpy as np
import pytest
from calmotion.model import Animation, Track
from calmotion.model.character import SurfaceMesh
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion_plugins.calibration.identification.excitation.clearance import Clearance

OPTIONS = RunSettings(step=1 / 240, pre_roll=0.0)
GAP = 0.03  # of bracket and hand in the first pose


def box(path, low, high):
    corners = np.array([[(low, high)[k][axis] for axis, k in enumerate(ends)] for ends in product((0, 1), repeat=3)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [half for a, b, c, d in sides for half in ((a, b, c), (a, c, d))]
    return SurfaceMesh(path, corners.astype(float), np.array(triangles, np.int32))


def with_shapes(arm, bracket_z=0.04):
    length = float(arm.joints[1].frame0.position[0])
    shapes = (
        box("/Arm/Upper/bracket", (0.0, -0.01, bracket_z), (2.0 * length + 0.03, 0.01, bracket_z + 0.02)),
        box("/Arm/Fore/tube", (0.02, -0.01, -0.01), (length - 0.02, 0.01, 0.01)),
        box("/Arm/Hand/palm", (0.0, -0.01, -0.01), (0.06, 0.01, 0.01)),
    )
    bodies = tuple(dataclasses.replace(b, surfaces=(s,)) for b, s in zip(arm.bodies, shapes, strict=True))
    return dataclasses.replace(arm, bodies=bodies)


def bent(shot, elbow):
    """The elbow bends by an angle and comes back."""
    times = np.linspace(0.0, 1.0, 25)
    tracks = (Track(times, np.zeros(25)), Track(times, elbow * np.sin(np.pi * times) ** 2))
    return dataclasses.replace(shot, animation=Animation(times, tracks, tracks))


@pytest.fixture(scope="module")
def shot(arm, animation, bodies):
    return bent(compile_shot(with_shapes(arm), animation, bodies), 0.0)


@pytest.fixture(scope="module")
def clearance(shot):
    return Clearance(shot, OPTIONS)


def between(clearance, shot):
    """What lies between the points of the two bodies."""
    return sum(clearance._surfaces[shot.tree.body.index(k)].between for k in (0, 2))


def test_bodies_that_no_joint_connects_are_watched(shot, clearance):
    (pair,) = clearance.pairs
    assert {pair.first, pair.second} == {"/Arm/Upper", "/Arm/Hand"} and clearance.together == ()
    assert GAP - between(clearance, shot) - 1e-9 <= pair.apart <= GAP


def test_distances_are_those_of_the_moved_boxes(shot, clearance):
    length = float(shot.character.joints[1].frame0.position[0])
    for elbow in (0.03, -0.03, 0.05):
        least = clearance.least(bent(shot, elbow))[0]
        # the corners of the hand about the elbow, against the bracket, in the plane of the motion
        angles = elbow * np.linspace(0.0, 1.0, 101)
        x, z = np.meshgrid(np.linspace(0.0, 0.06, 61), [-0.01, 0.01])
        best = np.inf
        for sign in (1.0, -1.0):
            found = []
            for angle in sign * angles:
                px = length + (length + x) * np.cos(angle) - z * np.sin(angle)
                pz = (length + x) * np.sin(angle) + z * np.cos(angle)
                off = np.hypot(np.maximum(px - (2.0 * length + 0.03), 0.0), np.maximum(0.04 - pz, 0.0))
                found.append(off.min())
            best = min(best, abs(min(found) - least - between(clearance, shot)))
        assert best < 4e-3, elbow
        assert least < clearance.pairs[0].apart + 1e-12


def test_motions_that_bring_bodies_together_are_not_kept(shot, clearance):
    assert clearance.kept(bent(shot, 0.01)) and clearance.kept(bent(shot, -0.01))
    least = [clearance.least(bent(shot, sign * 0.1))[0] for sign in (1.0, -1.0)]
    assert min(least) < 0.0 < max(least)
    assert not all(clearance.kept(bent(shot, sign * 0.1)) for sign in (1.0, -1.0))


def test_bodies_that_touch_in_the_first_pose_are_named(arm, animation, bodies):
    touching = bent(compile_shot(with_shapes(arm, bracket_z=0.005), animation, bodies), 0.0)
    found = Clearance(touching, OPTIONS)
    assert found.pairs == () and [set(pair) for pair in found.together] == [{"/Arm/Upper", "/Arm/Hand"}]
    assert found.kept(bent(touching, 0.3))


def test_a_robot_that_moves_freely_is_not_watched(arm, animation, bodies):
    loose = dataclasses.replace(with_shapes(arm), motors=arm.motors[:1])
    times = np.linspace(0.0, 1.0, 25)
    tracks = (Track(times, np.zeros(25)),)
    found = Clearance(compile_shot(loose, Animation(times, tracks, tracks), bodies), OPTIONS)
    assert not found.watches and found.pairs == () and len(found.together) == 1
