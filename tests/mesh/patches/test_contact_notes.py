"""Messages about joints that are off the surface of their bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.patches.contact_notes import contact_notes
from calmotion.model import FEMesh, FEMeshes, InterfaceSurface
from calmotion.model.meshes import MeshQuality
from calmotion.usd.reading import read_shot
from small_shots import ELBOW, FORE, LENGTH, WIDTH, make_flexible, write_arm


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return read_shot(str(write_arm(tmp_path_factory.mktemp("arm") / "shot.usda", make_flexible)))[0]


@pytest.fixture(scope="module")
def meshes(arm, helpers):
    """The forearm of the arm, meshed as a box."""
    points, tets = helpers.box((8, 1, 1), (LENGTH, WIDTH, WIDTH), origin=(0, -WIDTH / 2, -WIDTH / 2))
    (index,) = (k for k, body in enumerate(arm.bodies) if body.path == FORE)
    return FEMeshes((FEMesh(index, points, tets, MeshQuality(10.0, 1.0, 0.0)),))


def moved(arm, position):
    """The arm with its elbow elsewhere on the forearm."""

    def at(joint):
        if joint.path != ELBOW:
            return joint
        return replace(joint, frame1=replace(joint.frame1, position=np.array(position)))

    return replace(arm, joints=tuple(map(at, arm.joints)))


def test_joints_on_the_body_are_not_mentioned(arm, meshes):
    assert list(contact_notes(arm, meshes)) == []
    assert list(contact_notes(moved(arm, (-0.01, 0.0, 0.0)), meshes)) == []


def test_a_joint_off_the_body_is_told_with_its_distance_and_what_holds_it(arm, meshes):
    (note,) = contact_notes(moved(arm, (-0.1, 0.0, 0.0)), meshes)
    assert note.startswith(f"{FORE}: the frame of {ELBOW} is 100 mm off its surface") and "calmInterface" in note


def test_a_named_interface_needs_no_message(arm, meshes):
    far = moved(arm, (-0.1, 0.0, 0.0))
    named = InterfaceSurface("/subset", ELBOW, np.zeros((1, 3, 3)))
    bodies = tuple(replace(body, interfaces=(named,)) if body.flexible else body for body in far.bodies)
    assert list(contact_notes(replace(far, bodies=bodies), meshes)) == []


def test_joints_that_hold_one_part_of_the_surface_are_told_with_their_distance(arm, meshes):
    at = replace(
        next(joint for joint in arm.joints if joint.path == ELBOW).frame1, position=np.array([0.002, 0.0, 0.0])
    )
    (index,) = (k for k, body in enumerate(arm.bodies) if body.path == FORE)
    second = replace(arm.joints[0], path="/Arm/rod", body0=index, frame0=at, redundant=False)
    near = replace(arm, joints=(*arm.joints, second))
    (note,) = contact_notes(near, meshes)
    assert note.startswith(f"{FORE}: the frames of {ELBOW} and /Arm/rod are 2 mm apart") and "one part" in note
    far = replace(second, frame0=replace(at, position=np.array([0.5 * LENGTH, 0.0, 0.5 * WIDTH])))
    assert list(contact_notes(replace(arm, joints=(*arm.joints, far)), meshes)) == []
