"""First frequencies of damaged parts that are wrapped, and of beams, against the undamaged part."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from calmotion.mesh.mass import mass_of_solid
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.sources import choice
from calmotion.model import Frame
from calmotion.reduction.mesh_refinement import response
from calmotion.tolerance.meshes.options import MeshOptions
from mesher_links import FLEXIBLE, box, link, mesh_body, run, solid, surface

LENGTH, WIDTH, HEIGHT = 0.16, 0.03, 0.014
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
ROOT, TIP = Frame(np.zeros(3), IDENTITY), Frame(np.array([LENGTH, 0.0, 0.0]), IDENTITY)


def arm():
    return box((LENGTH, WIDTH, HEIGHT), at=(LENGTH / 2, 0.0, 0.0))


def boss(gap=0.0):
    """A round boss on the far end of the arm, sunk into it without a gap."""
    made = trimesh.creation.cylinder(0.012, 0.012, sections=24)
    made.apply_translation((LENGTH - 0.016, 0.0, HEIGHT / 2 + (0.006 + gap if gap else 0.004)))
    return made


def opened():
    """Without the top of the boss, the far end of the arm, a part of its lower side and a part of its edge."""
    whole = arm().subdivide().subdivide().subdivide()
    middle, normal = whole.triangles_center, whole.face_normals
    below = (normal[:, 2] < -0.5) & (np.abs(middle[:, 0] - 0.05) < 0.02)
    edge = (np.abs(middle[:, 0] - 0.1) < 0.005) & (middle[:, 1] > 0.012) & (middle[:, 2] > 0.005)
    whole.update_faces(~(below | edge | (normal[:, 0] > 0.5)))
    topless = boss()
    topless.update_faces(topless.face_normals[:, 2] < 0.5)
    return [whole, topless]


def flipped():
    parts = []
    for part in (arm().subdivide(), boss().subdivide()):
        faces = np.array(part.faces)
        faces[::2] = faces[::2, ::-1]
        parts.append(trimesh.Trimesh(part.vertices, faces, process=False))
    return parts


DAMAGED = {"holes": opened, "a gap of 0.5 mm": lambda: [arm(), boss(gap=5e-4)], "flipped normals": flipped}


def first(mesh, body):
    return response(mesh, body, [AttachmentFrame("root", ROOT, "interface")], 0, None, 3).compliances ** -0.5


def frequencies(host, body):
    (mesh,) = run(host, replace(body, flexible=replace(body.flexible, element_size=0.009)))
    return first(mesh, body), mesh.quality.source


def named(parts):
    return link(*(surface(part, f"/Arm/link/part{k}") for k, part in enumerate(parts)))


def test_damaged_parts_keep_their_volume():
    whole = solid(surface(arm(), "/a"), surface(boss(), "/b")).volume
    for name, damaged in DAMAGED.items():
        body = named(damaged())
        made = choice.solid_of(body, body.surfaces)
        sunk = np.pi * 0.012**2 * 2e-3 if "gap" in name else 0.0  # by which the boss without a gap is sunk
        assert made.volume == pytest.approx(whole + sunk, rel=0.02), name


@pytest.mark.long  # it makes five meshes
def test_first_frequencies_of_wrapped_parts_are_within_five_percent_and_of_a_beam_within_twenty(host):
    whole, source = frequencies(host, named([arm(), boss()]))
    assert source == "visual surface"
    for name, damaged in DAMAGED.items():
        wrapped, source = frequencies(host, named(damaged()))
        print(name, source, np.round(wrapped / whole - 1.0, 4))
        assert wrapped == pytest.approx(whole, rel=0.05), name
    made = solid(surface(arm(), "/a"), surface(boss(), "/b"))
    mass = mass_of_solid(made.points, made.triangles, FLEXIBLE.material.density)
    beam = mesh_body(body := replace(link(element_size=0.009), mass=mass), MeshOptions(), (ROOT, TIP))
    found = first(beam, body)
    print("beam", np.round(found / whole - 1.0, 4))
    assert beam.quality.source == "equivalent beam" and found[:2] == pytest.approx(whole[:2], rel=0.2)
