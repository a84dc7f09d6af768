"""Where a joint takes hold of a body that its frame does not touch."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from calmotion.mesh.patches.contact_place import contact_place

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
