"""Copies and mirror images of links are meshed once."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.sources import twins as twins_module
from calmotion.mesh.tetrahedra import tet_volumes
from calmotion.model import Frame
from calmotion.model.meshes import CutPatch
from calmotion.reduction.mesh_refinement import response
from calmotion.tolerance.meshes import accurate_mesh
from mesher_links import bracket, divided, link, run, surface

TURN = np.array([1.0, 0.0, 0.0, 0.0])
ROOT = Frame(np.array([-0.05, 0.0, 0.0]), TURN)
MIRROR = np.diag([1.0, -1.0, 1.0])


def bracket_surface(mirrored=False):
    whole = bracket()
    if mirrored:
        whole.apply_transform(np.diag([1.0, -1.0, 1.0, 1.0]))
    return surface(whole)


def test_the_mirror_image_of_a_link_is_meshed_once(host, monkeypatch):
    accuracy = accurate_mesh
    monkeypatch.setattr(accuracy, "MAX_NODES", 1_500)  # the meshes are refined as usual, and less far
    fill, count = accuracy.filled, []

    def counted(*arguments):
        count.append(arguments[1].path)
        return fill(*arguments)

    monkeypatch.setattr(accuracy, "filled", counted)
    left, right = link(bracket_surface()), replace(link(bracket_surface(mirrored=True)), path="/Arm/right")
    stiffer = replace(left.flexible, interface_radius=0.02)
    first, second, third = run(host, left, right, replace(left, path="/Arm/third", flexible=stiffer))
    assert sorted(count) == ["/Arm/link", "/Arm/third"]
    assert second.body == 1 and (tet_volumes(second.points, second.tets) > 0.0).all()
    assert second.points == pytest.approx(first.points @ MIRROR, abs=1e-9)
    assert "meshed as /Arm/link, mirrored" in second.quality.repairs and len(third.tets)
    assert not any("meshed as" in note for note in (*first.quality.repairs, *third.quality.repairs))
    # its own estimate of its own body agrees
    one, other = (response(mesh, body, (), None, None, 3) for mesh, body in ((first, left), (second, right)))
    assert other.compliances == pytest.approx(one.compliances, rel=1e-6)


def shape(body, frames=(ROOT,), size=-1.0):
    (part,) = body.surfaces
    return twins_module.Link(body, part.points, part.triangles, "visual surface", size, True, frames)


def test_links_are_twins_only_with_their_joints_at_the_same_places():
    twin_of = twins_module.twin_of
    tip, tilted = Frame(np.array([0.04, 0.006, 0.03]), TURN), Frame(np.array([0.04, 0.006, 0.03]), np.eye(4)[1])
    mirrored_tip = Frame(MIRROR @ tip.position, TURN)
    left = shape(link(bracket_surface()), (ROOT, tip))
    right = shape(link(bracket_surface(True)), (ROOT, mirrored_tip))
    index, isometry = twin_of(right, [left])
    assert index == 0 and isometry.mirrors
    assert twin_of(left, [left])[1].turn == pytest.approx(np.eye(3))
    assert twin_of(replace(right, frames=(ROOT, tip)), [left]) is None
    assert twin_of(replace(right, frames=(mirrored_tip, ROOT)), [left]) is None, "the first is the carrier"
    turned = replace(tilted, position=mirrored_tip.position)
    assert twin_of(replace(right, frames=(ROOT, turned)), [left]) is not None
    sideways = Frame(mirrored_tip.position, np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0]))
    assert twin_of(replace(right, frames=(ROOT, sideways)), [left]) is None, "another axis"
    assert twin_of(replace(right, size=0.01), [left]) is None
    assert twin_of(replace(right, source="collision surface"), [left]) is None


def test_links_with_other_triangles_are_twins_and_say_how_near(host):
    twins = twins_module
    body = link(bracket_surface())
    (part,) = body.surfaces
    points, triangles = divided(part.points, part.triangles)
    points[0] += 2e-5
    other = replace(body, path="/Arm/other", surfaces=(replace(part, points=points, triangles=triangles),))
    index, isometry = twins.twin_of(shape(other), [shape(body)])
    assert index == 0 and 1e-6 < isometry.distance <= np.sqrt(3.0) * 2e-5
    (mesh,) = run(host, link(bracket_surface(), element_size=0.02))
    assert (
        f"(within {1e3 * isometry.distance:.2g} mm)" in twins.moved(mesh, isometry, 1, "/Arm/link").quality.repairs[0]
    )


def test_patches_are_moved_with_the_mesh(host):
    (mesh,) = run(host, link(bracket_surface(), element_size=0.02))
    corners = mesh.points[mesh.tets[0, [0, 2, 1]]]
    mesh = replace(mesh, patches=(CutPatch(ROOT.position, corners[None]),))
    isometry = twins_module.Isometry(MIRROR, np.array([0.0, 0.5, 0.0]))
    image = twins_module.moved(mesh, isometry, 3, "/Arm/link")
    assert image.body == 3 and image.patches[0].origin == pytest.approx([-0.05, 0.5, 0.0])
    area = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    found = np.cross(*(image.patches[0].triangles[0, k] - image.patches[0].triangles[0, 0] for k in (1, 2)))
    assert found == pytest.approx(MIRROR @ area, abs=1e-12), "outward as before"
