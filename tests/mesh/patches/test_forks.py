"""A joint at one cheek of a fork holds both: the bores of its pin are told from those of a housing or a tube."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.patches.cut_patches import with_rims
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.patches.seats import bores, other_cheek
from calmotion.mesh.tetrahedra import surface_area
from calmotion.model import Frame
from calmotion.testing import host_with
from mesher_links import PLUGIN, box, link, run, surface

PIN, THICK, GAP = 0.006, 0.008, 0.03  # radius of the bores, thickness of the cheeks, and what is between them [m]
X = np.array([1.0, 0.0, 0.0])
ABOUT_X = np.array([1.0, 0.0, 1.0, 0.0]) / np.sqrt(2.0)  # turns the z axis to x
FACE = 0.5 * GAP


def bore(radius=PIN, start=-1.0, end=1.0, sections=32):
    made = trimesh.creation.cylinder(radius, end - start, sections=sections)
    made.apply_transform(trimesh.geometry.align_vectors([0.0, 0.0, 1.0], X))
    made.apply_translation(0.5 * (start + end) * X)
    return made


def fork(*holes, closed=False):
    """Two cheeks across x, joined below; `closed`, also above and on the sides."""
    parts = [box((THICK, 0.03, 0.05), (side * (FACE + 0.5 * THICK), 0.0, -0.01)) for side in (-1, 1)]
    parts.append(box((GAP + 2 * THICK, 0.03, 0.06), (0.0, 0.0, -0.06)))
    if closed:
        parts += [box((GAP + 2 * THICK, 0.03, 0.008), (0.0, 0.0, 0.014))]
        parts += [box((GAP + 2 * THICK, 0.006, 0.05), (0.0, side * 0.014, -0.01)) for side in (-1, 1)]
    return trimesh.boolean.difference([trimesh.boolean.union(parts), *(holes or [bore()])])


class Surface:
    def __init__(self, mesh):
        self.nodes, self.surface = np.array(mesh.vertices), np.array(mesh.faces)


@pytest.mark.parametrize("sections", [8, 12, 32])
@pytest.mark.parametrize("axis", [X, -X])
@pytest.mark.parametrize("at", [FACE, FACE + 0.5 * THICK, FACE + THICK, FACE - 0.004])
def test_the_other_cheek_is_as_far_behind_its_face(at, axis, sections):
    skin = Surface(fork(bore(sections=sections)))
    assert len(bores(skin, at * X, axis)) == 2
    found = other_cheek(skin, at * X, 1.3 * PIN, axis)
    assert found == pytest.approx(-at * X, abs=1e-6)


NO_FORKS = {
    "a joint between the cheeks": (fork(), 0.0, 1.3 * PIN),
    "a bore that the joint does not reach": (fork(), FACE, 0.8 * PIN),
    "another bore": (fork(bore(), bore(1.3 * PIN, 0.0, 1.0)), FACE, 1.6 * PIN),
    "a cheek without one": (fork(bore(end=0.0)), -FACE, 1.3 * PIN),
    "a slot": (fork(trimesh.boolean.union([bore(), box((1.0, 2 * PIN, 0.1), (0.0, 0.0, 0.05))])), FACE, 1.3 * PIN),
    "a housing": (fork(closed=True), FACE, 1.3 * PIN),
    "a tube": (trimesh.creation.annulus(PIN, 0.012, 0.1, transform=trimesh.geometry.align_vectors([0, 0, 1], X)), 0.05,
               1.3 * PIN),
    "both cheeks held": (fork(), 0.002, 0.03),
}  # fmt: skip


@pytest.mark.parametrize("name", NO_FORKS)
def test_what_is_no_fork_has_no_other_cheek(name):
    mesh, at, radius = NO_FORKS[name]
    assert other_cheek(Surface(mesh), at * X, radius, X) is None


def test_a_joint_at_one_cheek_holds_as_much_of_the_other():
    body = link(surface(fork()))
    (mesh,) = run(host_with(PLUGIN), body)
    joint = AttachmentFrame("/Arm/pin", Frame(FACE * X, ABOUT_X), "interface")
    points, _, ((origin, held),) = with_rims(mesh.points, mesh.tets, body, [joint])
    assert np.allclose(origin, FACE * X)
    near, far = (held[side * points[held].mean(axis=1)[:, 0] > 0.0] for side in (1, -1))
    assert surface_area(points, far) == pytest.approx(surface_area(points, near), rel=0.05)
    assert 2.0 * PIN * 0.004 < surface_area(points, near) < 6.0 * np.pi * PIN * THICK
