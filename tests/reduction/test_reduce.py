"""From a mesh to the reduced body."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.model import Body, FlexibleSettings, MassProperties, SurfaceMesh
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.reduce import reduce_body
from calmotion.reduction.reduced_body import rigid_invariants

SIZE = (0.6, 0.02, 0.02)


@pytest.fixture(scope="module")
def mesh(helpers):
    return helpers.mesh(*helpers.box((20, 2, 2), SIZE, origin=(0, -0.01, -0.01)))


@pytest.fixture
def body(helpers, plastic):
    return Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic))


@pytest.fixture
def attachments(helpers):
    return [
        AttachmentFrame("/Arm/hand", helpers.frame(0.6, 0.0, 0.0), "interface"),
        AttachmentFrame("/Arm/shoulder", helpers.frame(0.0, 0.0, 0.0), "interface"),
        AttachmentFrame("/Arm/target", helpers.frame(0.6, 0.0, 0.0), "point"),
        AttachmentFrame("/Arm/beyond", helpers.frame(0.65, 0.0, 0.0), "point"),
    ]


def test_the_root_stands_still_and_the_tip_moves_with_its_patch(mesh, body, attachments):
    reduced = reduce_body(mesh, body, attachments, [], 1)
    hand, shoulder, target, beyond = reduced.markers
    r = len(reduced.stiffness)
    assert r == 10 and np.abs(shoulder.Phi).max() == 0.0 and np.abs(shoulder.Psi).max() == 0.0
    assert np.array_equal(hand.position, [0.6, 0.0, 0.0])
    # the target lies in the middle of the rigid patch, so it does what the patch does
    assert np.abs(target.Phi - hand.Phi).max() < 1e-10 * np.abs(hand.Phi).max()
    arm = np.cross(beyond_rotation := beyond.Psi, np.array([0.05, 0, 0])[:, None], axis=0)
    assert np.abs(beyond.Phi - (target.Phi + arm)).max() < 1e-10 * np.abs(hand.Phi).max()
    assert np.abs(beyond_rotation - target.Psi).max() < 1e-10 * np.abs(target.Psi).max()


def test_joints_that_share_a_patch_turn_with_it_about_its_center(mesh, body, attachments, helpers):
    near = AttachmentFrame("/Arm/rod", helpers.frame(0.599, 0.001, 0.001), "interface")
    alone, both = (reduce_body(mesh, body, frames, [], 1) for frames in (attachments, [*attachments, near]))
    hand, rod = both.markers[0], both.markers[-1]
    assert np.array_equal(both.frequencies, alone.frequencies) and np.array_equal(rod.Psi, hand.Psi)
    expected = hand.Phi + np.cross(hand.Psi, np.array([-0.001, 0.001, 0.001])[:, None], axis=0)
    assert np.allclose(rod.Phi, expected, rtol=0.0, atol=1e-14 * np.abs(hand.Phi).max() + 1e-18)
    assert np.array_equal(rod.position, [0.599, 0.001, 0.001])


def test_the_invariants_are_those_of_the_solid(mesh, body, attachments, plastic):
    reduced = reduce_body(mesh, body, attachments, [], 1)
    m = plastic.density * np.prod(SIZE)
    a2, b2, c2 = np.square(SIZE)
    inertia = m / 12.0 * np.diag([b2 + c2, a2 + c2, a2 + b2])
    rigid = rigid_invariants(MassProperties(m, np.array([0.3, 0, 0]), inertia))
    inv = reduced.invariants
    assert inv.mass == pytest.approx(m, rel=1e-12)
    assert np.allclose(inv.s, rigid.s, atol=1e-12 * m) and np.allclose(inv.Z, rigid.Z, atol=1e-12 * m)
    assert np.abs(inv.M - np.eye(len(reduced.stiffness))).max() < 1e-10


def test_an_authored_mass_is_kept(mesh, body, attachments):
    heavy = replace(body, mass=MassProperties(5.0, np.zeros(3), np.eye(3)))
    light, reduced = reduce_body(mesh, body, attachments, [], 1), reduce_body(mesh, heavy, attachments, [], 1)
    assert reduced.invariants.mass == pytest.approx(5.0, rel=1e-12)
    ratio = np.sqrt(light.invariants.mass / 5.0)
    assert np.allclose(reduced.frequencies, light.frequencies * ratio, rtol=1e-6)


def test_a_skin_moves_with_the_body(mesh, body, attachments):
    points = np.array([[0.0, 0.005, 0.005], [0.6, 0.0, 0.0], [0.3, 0.0, 0.0101]])
    surface = SurfaceMesh("/Arm/link/skin", points, np.array([[0, 1, 2]], dtype=np.int32))
    reduced = reduce_body(mesh, body, attachments, [surface], 1)
    (skin,) = reduced.skin
    assert skin.shape == (3, 3, len(reduced.stiffness))
    assert np.abs(skin[0]).max() < 1e-12
    assert np.abs(skin[1] - reduced.markers[2].Phi).max() < 1e-10
    assert np.abs(skin[2]).max() > 1e-3


@pytest.mark.parametrize(
    ("field", "value"), [("youngs_modulus", 0.0), ("poissons_ratio", 0.5), ("density", -1.0), ("density", np.nan)]
)
def test_a_prim_that_is_not_a_material_is_refused(mesh, body, attachments, field, value):
    bad = replace(body, flexible=replace(body.flexible, material=replace(body.flexible.material, **{field: value})))
    with pytest.raises(ShotError) as caught:
        reduce_body(mesh, bad, attachments, [], 1)
    assert caught.value.path == "/Looks/Plastic"


def test_a_body_that_nothing_carries_is_refused(mesh, body, attachments):
    with pytest.raises(ShotError, match="no joint connects this flexible body"):
        reduce_body(mesh, body, attachments, [], 2)


def test_what_a_mesh_is_off_by_is_a_part_of_the_deflection(mesh, body, attachments):
    none = np.zeros(3)
    force = np.zeros((2, 3))
    force[0, 2] = 2.0
    loads = LoadEnvelope(none, none, none, force, np.zeros((2, 3)))
    judged = replace(mesh, quality=replace(mesh.quality, frequency_error=0.01))
    error = reduce_body(judged, body, attachments, [], 1, loads).mesh_error_m
    # two percent of the stiffness, of twice the deflection at rest
    at_rest = 2.0 * 0.6**3 / (3.0 * 1.8e9 * 0.02**4 / 12.0)
    assert 0.04 * at_rest < error < 0.06 * at_rest
    assert reduce_body(mesh, body, attachments, [], 1, loads).mesh_error_m is None
    assert reduce_body(judged, body, attachments, [], 1).mesh_error_m is None


def sentence(reduced):
    """What a report says about the elastic law."""
    return [(row.what, row.why) for row in reduced.left_out if "elasticity" in row.what or "strain" in row.what]


def test_a_report_says_why_the_elastic_law_is_linear(mesh, body, attachments):
    what = "/Arm/link: linear elasticity"
    assert sentence(reduce_body(mesh, body, attachments, [], 1)) == [
        (what, "its deflection is not known without a motion")
    ]
    for law, said in (("linear", [(what, "calm:flexible:elasticity is linear")]), ("stvk", [])):
        authored = replace(body, flexible=replace(body.flexible, elasticity=law))
        assert sentence(reduce_body(mesh, authored, attachments, [], 1)) == said
