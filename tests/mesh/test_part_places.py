"""Which part of an assembly holds a place."""

import numpy as np
import trimesh
from calmotion.mesh.parts import holders, part_of_places, places_of
from calmotion.mesh.tetrahedra import tet_volumes
from calmotion.model.meshes import Part


def part(mesh, name):
    return Part(f"/Body/{name}", f"/Looks/{name}", np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int32), 1, 1, 0)


def box(low, high, name):
    return part(trimesh.creation.box(bounds=[low, high]), name)


def test_an_insert_is_inside_the_shell_around_it_whatever_their_order():
    shell, insert = box((0, 0, 0), (1, 1, 1), "shell"), box((0.4, 0.4, 0.4), (0.6, 0.6, 0.6), "insert")
    places = np.array([[0.5, 0.5, 0.5], [0.1, 0.5, 0.5], [0.55, 0.45, 0.5]])
    assert holders(places, (shell, insert)).tolist() == [1, 0, 1]
    assert holders(places, (insert, shell)).tolist() == [0, 1, 0]


def test_between_parts_and_far_from_all_the_nearest_one_counts():
    parts = box((0, 0, 0), (1, 1, 1), "a"), box((1.1, 0, 0), (2, 1, 1), "b")
    places = np.array([[1.02, 0.5, 0.5], [1.08, 0.5, 0.5], [9.0, 0.5, 0.5], [-7.0, 0.0, 0.0]])
    assert holders(places, parts).tolist() == [0, 1, 1, 0]


def test_tetrahedra_across_a_side_are_divided_by_it(helpers):
    parts = box((0, 0, 0), (0.37, 1, 1), "a"), box((0.37, 0, 0), (1, 1, 1), "b")
    points, tets = helpers.box((4, 2, 2), (1.0, 1.0, 1.0))
    points = np.asarray(points)
    held = part_of_places(points, tets, parts, places_of(6))
    volume = tet_volumes(points, tets) @ (held == 0).mean(axis=1)
    assert abs(volume - 0.37) < 0.01
    middle = points[tets][:, :, 0]
    assert (held[middle.max(axis=1) < 0.3] == 0).all() and (held[middle.min(axis=1) > 0.4] == 1).all()
