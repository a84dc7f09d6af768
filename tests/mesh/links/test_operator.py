"""The operator: from the surfaces of a body to tetrahedra that fill them, in the size that was asked for."""

import os
import sys
from dataclasses import replace

import numpy as np
import pytest
from calmotion.host import PluginError
from calmotion.mesh.tetrahedra import connected_parts, tet_volumes, welded_tets
from calmotion.model import Body, TetGeometry
from mesher_links import REST, box, link, links_of, run, surface


def test_a_rigid_character_is_skipped(host):
    with pytest.raises(PluginError, match="nothing is flexible"):
        run(host, Body("/Arm/link", REST, None, (surface(box()),)))


def test_a_box_becomes_tetrahedra_that_fill_it(host):
    rigid = Body("/Arm/base", REST, None)
    (mesh,) = run(host, rigid, link(surface(box((0.3, 0.02, 0.02), at=(0.15, 0, 0))), element_size=0.011))
    assert mesh.body == 1 and mesh.tets.dtype == np.int32
    assert (tet_volumes(mesh.points, mesh.tets) > 0.0).all() and connected_parts(mesh.tets) == 1
    assert mesh.quality.volume == pytest.approx(1.2e-4, rel=1e-3)
    assert mesh.quality.volume_error < 1e-3 and mesh.quality.min_dihedral_deg > 5.0
    assert 200 < len(mesh.tets) < 3000
    assert np.allclose(mesh.points.min(axis=0), [0, -0.01, -0.01], atol=2e-4)
    assert np.allclose(mesh.points.max(axis=0), [0.3, 0.01, 0.01], atol=2e-4)


def test_smaller_elements_are_more_and_the_command_line_goes_before_the_shot(host):
    body = link(surface(box((0.1, 0.02, 0.02))), element_size=0.02)
    (coarse,) = run(host, body)
    (fine,) = run(host, body, element_size="8mm")
    assert len(fine.tets) > 2 * len(coarse.tets)


def test_the_mesher_needs_no_viewer_library(host):
    run(host, link(surface(box((0.05, 0.02, 0.02))), element_size=0.01))
    assert not {"pyvista", "vtk", "vtkmodules"} & set(sys.modules)


def test_authored_tetrahedra_are_taken_as_they_are_but_turned(host):
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [9, 9, 9]])
    tets = TetGeometry("/Arm/link/tets", points, np.array([[0, 1, 2, 3], [1, 2, 3, 4][::-1]], dtype=np.int32))
    volumes = tet_volumes(points, tets.tets)
    (mesh,) = run(host, replace(link(surface(box())), tets=tets))
    assert np.array_equal(mesh.points, points[:5])
    assert mesh.quality.volume == pytest.approx(np.abs(volumes).sum()) and mesh.quality.volume_error == 0.0
    assert any("points that no tetrahedron uses" in repair for repair in mesh.quality.repairs)
    assert any("inverted" in repair for repair in mesh.quality.repairs) == bool((volumes < 0).any())


def test_authored_tetrahedra_that_touch_along_an_edge_are_told(host, helpers):
    points, tets = helpers.box((1, 1, 1), (1.0, 1.0, 1.0))
    ring = [(1, 0, 0), (0, 0, 0), (0, 1, 0), (0, 2, 0), (1, 2, 0), (2, 2, 0), (2, 1, 0)]  # the last touches the first
    stacked = np.vstack([points + np.array(cell, float) for cell in ring])
    told = []
    for cells in (ring, ring[:-1]):
        count = len(cells) * len(points)
        joined = np.vstack([tets + k * len(points) for k in range(len(cells))])
        given = TetGeometry("/Arm/link/tets", *welded_tets(stacked[:count], joined, 1e-9)[:2])
        (mesh,) = run(host, replace(link(surface(box())), tets=given))
        told.append([repair for repair in mesh.quality.repairs if "no face" in repair])
        assert np.array_equal(mesh.points, given.points)
    assert "at 2 points" in told[0][0] and not told[1]


def test_a_link_of_a_real_robot_is_meshed(host, shared_data):
    (elbow,) = links_of(shared_data, "left_elbow_link")
    (mesh,) = run(host, link(*elbow, element_size=0.012))
    assert mesh.quality.volume_error < 0.01 and mesh.quality.min_dihedral_deg > 1.0
    assert 800 < len(mesh.tets) < 6000


def test_nothing_is_left_behind(host, own_cache, tmp_path, monkeypatch):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setenv("TMPDIR", str(scratch))
    monkeypatch.setattr("tempfile.tempdir", None)
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    run(host, link(surface(box((0.05, 0.02, 0.02))), element_size=0.01), cache=False)
    assert os.listdir(work) == []
    assert os.listdir(scratch) == [] and not own_cache.exists()


def test_links_are_meshed_beside_each_other_with_the_meshes_of_one_after_the_other(host, monkeypatch):
    bodies = [
        replace(link(surface(box((0.1 + 0.02 * k, 0.02, 0.02))), element_size=0.02), path=f"/Arm/link{k}")
        for k in range(4)
    ]
    bodies.insert(2, replace(bodies[0], path="/Arm/copy"))
    together = run(host, *bodies)
    monkeypatch.setattr("calmotion.multibody.parallel.processors", lambda: 1)
    for mesh, alone in zip(together, run(host, *bodies, cache=False), strict=True):
        assert mesh.body == alone.body and np.array_equal(mesh.tets, alone.tets)
        assert mesh.points == pytest.approx(alone.points, abs=1e-12) and mesh.quality.repairs == alone.quality.repairs
    assert [mesh.body for mesh in together] == [0, 1, 2, 3, 4]
    assert any("meshed as /Arm/link0" in note for note in together[2].quality.repairs)
