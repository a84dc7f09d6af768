"""The seat of a servo horn or a flange, on surfaces with screw holes, recesses and none."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.mesh_shaping import Surface
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches
from calmotion.mesh.patches.seats import seat_radius
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.model.meshes import CutPatch

Z, ORIGIN = np.array([0.0, 0.0, 1.0]), np.zeros(3)


def arm(holes=0, boss=0.011):
    """A bar of 160 x 30 x 12 mm with a round boss at one end, whose top is at z = 0, with a bore and screw holes."""
    bar = trimesh.creation.box((0.16, 0.03, 0.012))
    bar.apply_translation((0.065, 0.0, -0.009))
    round_boss = trimesh.creation.cylinder(boss, 0.006, sections=48)
    round_boss.apply_translation((0.0, 0.0, -0.003))
    bore = trimesh.creation.cylinder(0.004, 0.03, sections=24)
    screws = []
    for k in range(holes):
        screw = trimesh.creation.cylinder(0.0015, 0.01, sections=16)
        angle = 2.0 * np.pi * k / holes
        screw.apply_translation((0.0075 * np.cos(angle), 0.0075 * np.sin(angle), 0.0))
        screws.append(screw)
    return trimesh.boolean.difference([bar.union(round_boss), bore, *screws])


@pytest.mark.parametrize("holes", [0, 4])
def test_a_seat_reaches_to_the_edge_of_the_boss(holes):
    triangles = arm(holes).triangles
    assert seat_radius(ORIGIN, Z, triangles) == pytest.approx(0.011, rel=0.05)
    assert seat_radius(ORIGIN, -Z, triangles) == pytest.approx(0.011, rel=0.05)
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    assert seat_radius(turn @ [1.0, 2.0, 3.0], turn @ Z, (triangles + [1.0, 2.0, 3.0]) @ turn.T) == pytest.approx(
        0.011, rel=0.05
    )


def test_flats_that_do_not_end_at_one_distance_from_the_axis_are_no_seats():
    triangles = arm().triangles
    for place, axis in (([0.08, 0.0, -0.003], Z), ([0.08, 0.015, -0.009], np.array([0.0, 1.0, 0.0]))):
        assert seat_radius(np.array(place), axis, triangles) is None, "the side of the bar"
    assert seat_radius(ORIGIN, np.array([1.0, 0.0, 0.0]), triangles) is None, "the axis is in the plane"
    assert seat_radius(np.array([0.0, 0.0, 0.004]), Z, triangles) is None, "4 mm above"
    plate = trimesh.creation.box((0.4, 0.4, 0.01)).triangles
    assert seat_radius(np.array([0.0, 0.0, 0.005]), Z, plate) is None
    assert seat_radius(np.array([0.19, 0.0, 0.005]), Z, plate) is None


def test_a_patch_is_that_of_the_surface_whatever_the_elements_are(helpers):
    """A joint on a block whose surface has a boss that its elements do not follow."""
    points, tets = helpers.box((16, 3, 2), (0.16, 0.03, 0.012), origin=(-0.015, -0.015, -0.012))
    mesh = quadratic_mesh(points, tets)
    whole = arm(4)
    surface = Surface(np.array(whole.vertices), np.array(whole.faces), float(whole.volume), 1e-3)
    joint = AttachmentFrame("/j", helpers.frame(0.0, 0.0, 0.0), "interface")
    (measured,) = interface_patches(mesh, [joint], -1.0, "/b", meshed=surface)
    (coarse,) = interface_patches(mesh, [joint], -1.0, "/b")
    assert measured.radius == pytest.approx(0.011, rel=0.05)
    assert coarse.radius == pytest.approx(0.012, rel=0.02), "of the elements alone: the depth of the bar"


def test_a_cut_patch_whose_nodes_are_all_nearer_to_another_joint_gives_way_to_what_is_left(helpers):
    """The palm of a hand: joints so near to each other that one has none of what was cut for it."""
    mesh = quadratic_mesh(*helpers.box((10, 3, 3), (0.1, 0.02, 0.02)))
    first, second = (
        AttachmentFrame(f"/j{k}", helpers.frame(x, 0.01, 0.0), "interface") for k, x in enumerate((0.02, 0.08))
    )
    corners = mesh.nodes[mesh.surface[:, :3]]
    at_the_first = corners[np.linalg.norm(corners.mean(axis=1) - first.frame.position, axis=1) < 0.012]
    assert len(at_the_first)
    cut = (CutPatch(second.frame.position, at_the_first),)
    one, other = interface_patches(mesh, [first, second], -1.0, "/b", cut)
    assert len(one.nodes) >= 6 and len(other.nodes) >= 6 and not np.intersect1d(one.nodes, other.nodes).size
