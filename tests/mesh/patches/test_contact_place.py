"""Where a joint takes hold of a body that its frame does not touch."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from calmotion.mesh.patches.contact_notes import contact_notes
from calmotion.mesh.patches.contact_place import contact_place
from calmotion.mesh.patches.joint_places import nearest_apart
from calmotion.mesh.tetrahedra import boundary_triangles
from calmotion.model import FEMesh, FEMeshes, InterfaceSurface
from calmotion.model.meshes import MeshQuality
from calmotion.usd.reading import read_shot
from small_shots import ELBOW, FORE, LENGTH, WIDTH, make_flexible, write_arm

AXIS = np.array([0.0, 0.0, 1.0])


def placed(mesh, *center, axis=AXIS):
    return contact_place(np.array(center), axis, np.array(mesh.triangles), np.array(mesh.vertices))


@pytest.fixture(scope="module")
def flanged():
    """A plate of 0.3 m with a tube of 20 and 30 mm radius on it, 60 mm high, at x = 0.1 m."""
    tube = trimesh.creation.annulus(0.02, 0.03, 0.06, sections=48)
    tube.apply_translation((0.1, 0.0, 0.03))
    plate = trimesh.creation.box((0.3, 0.08, 0.01))
    plate.apply_translation((0.0, 0.0, -0.005))
    return trimesh.util.concatenate([plate, tube])


def test_a_frame_on_or_in_the_body_is_its_own_place(flanged):
    assert placed(flanged, 0.1, 0.0, 0.03) is None
    assert placed(flanged, -0.1, 0.0, 0.001) is None


def test_a_frame_beyond_a_bore_holds_the_end_of_the_bore(flanged):
    place = placed(flanged, 0.1, 0.0, 0.2)
    assert place.kind == "ring" and place.distance == pytest.approx(np.hypot(0.14, 0.02), rel=1e-3)
    assert place.position[:2] == pytest.approx([0.1, 0.0], abs=1e-9)
    assert 0.03 <= place.position[2] <= 0.045  # as deep as the bore is wide, from its upper end


def test_a_frame_aside_of_all_rings_holds_the_nearest_place(flanged):
    place = placed(flanged, -0.12, 0.2, 0.0, axis=np.array([1.0, 0.0, 0.0]))
    assert place.kind == "face" and place.distance == pytest.approx(0.16)
    assert place.position == pytest.approx([-0.12, 0.04, 0.0], abs=6e-3)


def test_a_frame_above_a_plate_holds_the_plate_below_it():
    plate = trimesh.creation.box((0.3, 0.3, 0.01))
    place = placed(plate, 0.02, 0.03, 0.25)
    assert place.kind == "flange" and place.distance == pytest.approx(0.245)
    assert place.position == pytest.approx([0.02, 0.03, 0.005], abs=1e-6)


def test_the_place_turns_with_the_body(flanged):
    turn = trimesh.transformations.euler_matrix(0.3, 0.6, 0.2)
    turned = flanged.copy()
    turned.apply_transform(turn)
    there = placed(turned, *(turn[:3, :3] @ [0.1, 0.0, 0.2]), axis=turn[:3, 2])
    here = placed(flanged, 0.1, 0.0, 0.2)
    assert there.kind == "ring" and turn[:3, :3].T @ there.position == pytest.approx(here.position, abs=1e-3)


def test_a_flat_surface_has_no_inside():
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    assert placed(sheet, 0.5, 0.5, 0.5).kind in ("flange", "face")


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
    assert note.startswith(f"{FORE}: the frames of {ELBOW} and /Arm/rod are 2 mm apart") and "share one" in note
    far = replace(second, frame0=replace(at, position=np.array([0.5 * LENGTH, 0.0, 0.5 * WIDTH])))
    assert list(contact_notes(replace(arm, joints=(*arm.joints, far)), meshes)) == []


def test_slender_bodies_tell_near_joints_apart_and_stout_ones_do_not(helpers):
    def apart(length, radius=-1.0):
        points, tets = helpers.box((4, 1, 1), (length, 0.02, 0.02))
        return nearest_apart(points[boundary_triangles(tets)], radius)

    assert 0.002 < apart(0.6) < 0.003  # an eighth of the width
    assert apart(0.02) == pytest.approx(0.05 / 0.45 * 0.02 * np.sqrt(3.0))
    assert apart(0.6, radius=0.01) == pytest.approx(1e-6 * 0.6, rel=0.01)
