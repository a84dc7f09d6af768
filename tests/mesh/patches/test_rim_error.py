"""What the rims of interface patches cost: against patches of other sizes."""

import numpy as np
import pytest
from boxes import fe_mesh
from calmotion.mesh.patches.cut_patches import with_rims
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches
from calmotion.mesh.patches.rim_error import compliance_error, rim_edges, rim_error
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.model import Body, ElasticMaterial, FlexibleSettings, Frame
from calmotion.model.meshes import CutPatch
from calmotion.reduction.reduce import reduce_body

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
PLASTIC = ElasticMaterial("/Plastic", 2e9, 0.35, 1200.0, 0.02)
SIZE = (0.2, 0.06, 0.02)  # of a plate that is clamped at an end and holds a joint on its upper side [m]


def frame(*position):
    return Frame(np.array(position), IDENTITY)


ATTACHMENTS = [
    AttachmentFrame("/C/Root", frame(0.0, 0.0, 0.0), "interface"),
    AttachmentFrame("/C/Tip", frame(0.17, 0.0, 0.01), "interface"),
]


def body(radius):
    return Body("/C/Plate", frame(0.0, 0.0, 0.0), None, flexible=FlexibleSettings(PLASTIC, interface_radius=radius))


@pytest.fixture(scope="module")
def plate(helpers):
    return helpers.box((10, 4, 1), SIZE, origin=(0.0, -0.03, -0.01))


def turned(points, tets, radius, patches=()):
    """Compliance of the tip against turns about the longest axis across, and the estimated error of it."""
    from dataclasses import replace

    mesh = replace(fe_mesh(points, tets), patches=patches)
    found = reduce_body(mesh, body(radius), ATTACHMENTS, (), 0)
    tip = found.markers[1].Psi
    return float((tip[1] ** 2 / found.stiffness).sum()), found.patch_error


def test_an_end_face_has_no_rim_of_its_own(plate):
    mesh = quadratic_mesh(*plate)
    root = interface_patches(mesh, ATTACHMENTS, -1.0, "/C/Plate")[0]
    assert rim_error(mesh, root, np.zeros(3), ())[0] == 0.0


def test_a_rim_of_eight_edges_is_nearly_a_circle():
    angles = 2.0 * np.pi * np.arange(9) / 8
    rim = 0.01 * np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    triangles = np.stack([np.zeros((8, 3)), rim[:-1], rim[1:]], axis=1)
    assert rim_edges(triangles) == 8
    assert rim_edges(triangles[:1]) == 3
    mesh_free = type("Mesh", (), {"nodes": rim, "surface": np.zeros((0, 6), int)})
    patch = type("Patch", (), {"center": None, "radius": 0.01, "nodes": np.arange(8)})
    error, radius = rim_error(mesh_free, patch, np.zeros(3), [CutPatch(np.zeros(3), triangles)])
    assert error == pytest.approx(0.015 / 8)
    assert radius == pytest.approx(0.01 * np.sqrt(8 * np.sin(np.pi / 4) / (2 * np.pi)))


def test_the_estimate_bounds_what_cutting_the_rim_changes(plate):
    """Patches of whole elements, and cut ones of 8 mm: the compliance changes by less than is estimated for both."""
    points, tets = plate
    coarse, by_elements = turned(points, tets, 0.008)
    cut_points, cut_tets, rims = with_rims(points, tets, body(0.008), ATTACHMENTS)
    patches = tuple(CutPatch(origin, cut_points[triangles]) for origin, triangles in rims)
    fine, by_cut = turned(cut_points, cut_tets, 0.008, patches)
    assert 0.0 < by_cut < 0.2 * by_elements
    assert abs(coarse / fine - 1.0) < by_elements + by_cut


def test_the_share_of_a_small_patch_is_that_of_a_disc_on_a_half_space():
    """A moving patch that turns on its ground alone: 1% of its radius is 3% of the compliance."""
    shear = PLASTIC.youngs_modulus / (2.0 * (1.0 + PLASTIC.poissons_ratio))
    own = 3.0 * (1.0 - PLASTIC.poissons_ratio) / (8.0 * shear * 1e-3**3)
    motion = np.zeros((1, 6, 1))
    motion[0, 4, 0] = 1.0
    for softer, share in ((1.0, 1.0), (4.0, 0.25)):
        error = compliance_error([(0.0, 1.0), (0.01, 1e-3)], PLASTIC, np.array([1.0 / (softer * own)]), motion)
        assert error == pytest.approx(0.03 * share)
