"""What counts as one solid, and its mass against that of boxes and of tetrahedra."""

from dataclasses import replace

import numpy as np
import pytest
from boxes import box_tets
from calmotion.mesh.parts.mesh_mass import mass_of_tets
from calmotion.mesh.solid import mass_of_solid, solid_of
from calmotion.model import MassProperties, TetGeometry
from solids import body_of, box, inside_out, joined, prism, rotated, tube


def alike(found, expected, tolerance=1e-10):
    assert found.mass == pytest.approx(expected.mass, rel=tolerance)
    assert np.allclose(found.center, expected.center, rtol=0, atol=tolerance)
    assert np.allclose(found.inertia, expected.inertia, rtol=tolerance, atol=tolerance * np.trace(expected.inertia))


def test_a_box_weighs_what_its_tetrahedra_weigh():
    turn, offset = rotated(np.array([1.0, -2.0, 0.3]), 0.8), np.array([3.0, -5.0, 7.0])
    points, triangles = box((0.3, 0.04, 0.02))
    nodes, tets = box_tets((3, 2, 1), (0.3, 0.04, 0.02))
    found = mass_of_solid(points @ turn.T + offset, triangles, 1200.0)
    alike(found, mass_of_tets(nodes @ turn.T + offset, tets, 1200.0), 1e-9)


def test_a_cavity_weighs_nothing():
    whole, hole = box((0.3, 0.04, 0.04)), box((0.2, 0.02, 0.02), (0.05, 0.01, 0.01))
    found = solid_of(body_of(joined(whole, inside_out(hole))))
    outside, inside = mass_of_solid(*whole, 1200.0), mass_of_solid(*hole, 1200.0)
    alike(found.mass, MassProperties(outside.mass - inside.mass, outside.center, outside.inertia - inside.inertia))


def test_the_mass_of_the_body_scales_its_density():
    own = MassProperties(5.0, np.ones(3), np.eye(3))
    plain, scaled = (solid_of(body_of(box((0.3, 0.04, 0.02)), mass=mass)).mass for mass in (None, own))
    assert scaled.mass == pytest.approx(5.0) and np.allclose(scaled.center, plain.center)
    assert np.allclose(scaled.inertia, plain.inertia * 5.0 / plain.mass)


def test_a_surface_cut_into_several_is_one_solid():
    points, triangles = prism(12, 0.02, 0.2)
    found = solid_of(body_of((points, triangles[:20]), (points, triangles[20:])))
    alike(found.mass, mass_of_solid(points, triangles, 1200.0))


def test_a_copy_of_a_surface_is_skipped():
    assert solid_of(body_of(box((0.3, 0.04, 0.02)), box((0.3, 0.04, 0.02)))) is not None


def test_points_that_no_triangle_uses_do_not_matter():
    points, triangles = box((0.3, 0.04, 0.02))
    assert len(solid_of(body_of((np.vstack([points, [[np.nan] * 3]]), triangles))).points) == 8


def test_authored_tetrahedra_come_before_surfaces():
    nodes, tets = box_tets((3, 2, 1), (0.3, 0.04, 0.02))
    tets = np.array(tets)
    tets[::2] = tets[::2][:, [0, 2, 1, 3]]  # either way round
    found = solid_of(body_of(box((9.0, 9.0, 9.0)), tets=TetGeometry("/Robot/Link/Tets", nodes, tets)))
    alike(found.mass, mass_of_tets(nodes, tets, 1200.0))


def test_what_is_not_one_solid_is_refused():
    whole = box((0.3, 0.04, 0.02))
    wrong_index = np.array(whole[1])
    wrong_index[0, 0] = 99
    turned = np.array(whole[1])
    turned[0] = turned[0, ::-1]
    stranger = inside_out(box((0.01, 0.01, 0.01), (1.0, 0.0, 0.0)))
    refused = {
        "rigid": replace(body_of(whole), flexible=None),
        "mesh file": body_of(whole, mesh_file="link.stl"),
        "nothing": body_of(),
        "no triangles": body_of((whole[0], np.zeros((0, 3), np.int32))),
        "open": body_of((whole[0], whole[1][1:])),
        "inside out": body_of(inside_out(whole)),
        "one triangle inside out": body_of((whole[0], turned)),
        "two parts": body_of(whole, box((0.1, 0.1, 0.1), (1.0, 0.0, 0.0))),
        "two parts at an edge": body_of(whole, box((0.1, 0.04, 0.02), (0.3, 0.04, 0.0))),
        "solid within solid": body_of(joined(box((1.0, 1.0, 1.0)), box((0.1, 0.1, 0.1), (0.2, 0.2, 0.2)))),
        "cavity outside": body_of(joined(whole, stranger)),
        "index": body_of((whole[0], wrong_index)),
        "not finite": body_of((whole[0] * [np.nan, 1.0, 1.0], whole[1])),
        "flat": body_of((whole[0] * [1.0, 1.0, 0.0], whole[1])),
        "flat tetrahedra": body_of(whole, tets=TetGeometry("/T", np.zeros((4, 3)), np.array([[0, 1, 2, 3]]))),
    }
    assert [name for name, body in refused.items() if solid_of(body) is not None] == []
    assert solid_of(body_of(tube((0.3, 0.04, 0.04), 0.004))) is not None
