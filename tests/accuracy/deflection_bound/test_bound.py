"""How far bodies are said to bend, against the finite elements that this saves."""

from dataclasses import replace

import numpy as np
import pytest
from boxes import box_tets, fe_mesh
from calmotion.accuracy.deflection_bound.bound import Stiffness, static_reach
from calmotion.geometry.tetrahedra import boundary_triangles, oriented_tets
from calmotion.multibody.model.joint_arrays import BodyAnchors
from calmotion.reduction.basis.static_loads import OVERSHOOT, peak_loads, unit_accelerations
from calmotion.reduction.elements.embedding import embed
from calmotion.reduction.interfaces.interface_patches import AttachmentFrame
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.reduce import linear_modes
from solids import PLASTIC, STEEL, body_of, box, frame, inside_out, joined, rotated, tube

ENDS = [(0.0, 0.0, 0.0), (0.3, 0.0, 0.0)]
LOOSEST = 40.0  # times too high, for a plain bar; 12 to 20 are measured, 8 of which are SAFETY and OVERSHOOT


def bar(length=0.3, width=0.03, height=0.03, across=2):
    counts = (max(4, round(length / max(width, height) * across)), across, across)
    return box_tets(counts, (length, width, height), (0.0, -width / 2, -height / 2))


def cylinder(length=0.3, radius=0.015):
    points, tets = box_tets((16, 4, 4), (length, 2.0, 2.0), (0.0, -1.0, -1.0))
    y, z = points[:, 1].copy(), points[:, 2].copy()
    # a square to a disc, both of half width one
    points[:, 1], points[:, 2] = radius * y * np.sqrt(1 - z**2 / 2), radius * z * np.sqrt(1 - y**2 / 2)
    return points, oriented_tets(points, tets)[0]


def tapered(length=0.3, thick=0.04, thin=0.015):
    points, tets = box_tets((16, 2, 2), (length, 1.0, 1.0), (0.0, -0.5, -0.5))
    points[:, 1:] *= thick + (thin - thick) * points[:, :1] / length
    return points, tets


def cut_out(points, tets, keep):
    tets = tets[keep(points[tets].mean(axis=1))]
    used, number = np.unique(tets, return_inverse=True)
    return points[used], number.reshape(tets.shape).astype(np.int32)


def stepped(aside=0.0):
    """A bar of 40 mm, of 20 mm in its further half, there moved aside."""
    points, tets = box_tets((12, 4, 4), (0.3, 0.04, 0.04), (0.0, -0.02, -0.02))
    return cut_out(points, tets, lambda x: (x[:, 0] < 0.15) | (np.abs(x[:, 1:] - [aside, 0.0]).max(axis=1) < 0.01))


def angled():
    """Two limbs of 30 mm at a right angle, 0.2 m each."""
    points, tets = box_tets((12, 12, 2), (0.2, 0.2, 0.03))
    return cut_out(points, tets, lambda x: (x[:, 0] < 0.0333) | (x[:, 1] < 0.0333))


def surface_of(solid):
    return solid[0], boundary_triangles(solid[1])


def anchors_of(places, joints, root=0):
    frames = tuple(frame(*place) for place in places)
    return BodyAnchors(tuple(range(joints)), tuple(range(len(places) - joints)), frames, root)


def loads(rng, joints, root=0, size=1.0):
    """Peaks of a lively motion with a payload of some newtons beyond each joint."""
    force, moment = rng.uniform(0, 20, (joints, 3)), rng.uniform(0, 1, (joints, 3))
    force[root] = moment[root] = 0.0
    return LoadEnvelope(
        *(size * rng.uniform(0, scale, 3) for scale in (15.0, 40.0, 6.0)), size * force, size * moment, 3.0,
        rng.uniform(0, 0.5, joints),
    )  # fmt: skip


def finite_elements(solid, anchors, load_envelope, material=PLASTIC):
    """Largest displacement [m] and turn [rad] at the anchors that static loads make, as if all peaks met."""
    points, tets = solid
    body = body_of(surface_of(solid), material=material, elasticity="linear")
    count = len(anchors.joints)
    kinds = ["interface"] * count + ["point"] * (len(anchors.frames) - count)
    places = [
        AttachmentFrame(f"/A{k}", item, kind) for k, (item, kind) in enumerate(zip(anchors.frames, kinds, strict=True))
    ]
    linear = linear_modes(fe_mesh(points, tets), body, places, anchors.root, load_envelope, 1e-12)
    model, basis = linear.model, linear.basis
    assert basis.cut_error_m <= 1e-9
    nodes = model.mesh.nodes
    n, r = len(nodes), len(basis.omega_squared)
    weight = (model.mass @ unit_accelerations(nodes).reshape(n, 36)).reshape(3 * n, 12)
    motion = basis.patch_motion
    work = np.hstack([basis.modes.reshape(3 * n, r).T @ weight, motion.reshape(-1, r).T])
    responses = work / basis.omega_squared[:, None] * peak_loads(linear.load_envelope)
    tied = embed(model.mesh, np.array([a.frame.position for a in places if a.kind == "point"]).reshape(-1, 3))
    lever = linear.load_envelope.lever_arm
    found = []
    for k, patch in enumerate(motion):
        u, turn = np.abs(patch[:3] @ responses).sum(axis=1), np.abs(patch[3:] @ responses).sum(axis=1)
        found.append((np.linalg.norm(u) + lever[k] * np.linalg.norm(turn), np.linalg.norm(turn)))
    for u, turn in zip(tied.displacements(basis.modes), tied.rotations(basis.modes), strict=True):
        found.append([np.linalg.norm(np.abs(x @ responses).sum(axis=1)) for x in (u, turn)])
    return np.max(found, axis=0)


def ratios(solid, places, joints, seed=0, root=0, **parts):
    """Estimates over what finite elements say, of displacement and turn; `parts` replaces loads."""
    anchors = anchors_of(places, joints, root)
    load_envelope = replace(loads(np.random.default_rng(seed), joints, root), **parts)
    found = static_reach(body_of(surface_of(solid)), anchors, load_envelope)
    return np.array([found.displacement_m, found.rotation]) / finite_elements(solid, anchors, load_envelope)


def plain(surface=None, **settings):
    """How far a bar bends, or another surface in its place, held and loaded at its ends."""
    body = body_of(box((0.3, 0.03, 0.03), (0.0, -0.015, -0.015)) if surface is None else surface, **settings)
    return static_reach(body, anchors_of(ENDS, 2), loads(np.random.default_rng(0), 2))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    "solid, places, joints",
    [
        (bar(), ENDS, 2),
        (bar(), [(0.02, 0.0, 0.015), (0.28, 0.0, 0.015), (0.3, 0.0, 0.0)], 2),
        (bar(), [(0.0, 0.0, 0.0), (0.15, 0.0, 0.015), (0.3, 0.0, 0.0), (0.3, 0.015, 0.015)], 3),
        (bar(0.3, 0.06, 0.015), ENDS, 2),
        (bar(0.09), [(0.0, 0.0, 0.0), (0.09, 0.0, 0.0)], 2),
        (bar(0.03, across=3), [(0.0, 0.0, 0.0), (0.03, 0.0, 0.0)], 2),
        (cylinder(), ENDS, 2),
        (tapered(), ENDS, 2),
        (stepped(), ENDS, 2),
    ],
    ids=["ends", "sides", "several", "flat", "short", "cube", "cylinder", "tapered", "stepped"],
)
def test_the_deflection_of_plain_bars_is_below_the_bound_but_not_far_below(solid, places, joints, seed):
    found = ratios(solid, places, joints, seed)
    assert (found >= OVERSHOOT).all() and (found < LOOSEST).all(), found


@pytest.mark.parametrize("part", ["acceleration", "angular_acceleration", "angular_velocity", "force", "moment"])
def test_the_deflection_by_each_load_is_below_the_bound(part):
    nothing = {name: np.zeros(3) for name in ("acceleration", "angular_acceleration", "angular_velocity")}
    nothing |= {name: np.zeros((2, 3)) for name in ("force", "moment")}
    load = np.array([3.0, 2.0, 1.0]) if nothing[part].ndim == 1 else np.array([[0.0, 0.0, 0.0], [3.0, 2.0, 1.0]])
    found = ratios(stepped(), ENDS, 2, **(nothing | {part: load}))
    assert (found >= OVERSHOOT).all() and (found < LOOSEST).all(), found


def cut_bar(keep, size=(0.3, 0.03, 0.03), counts=(30, 6, 2), aside=-0.015):
    return cut_out(*box_tets(counts, size, (0.0, aside, -size[2] / 2)), keep)


AWKWARD = {
    "steps aside": (stepped(0.01), [(0.0, 0.0, 0.0), (0.3, 0.01, 0.0)]),
    "thin end holds": (tapered(), ENDS[::-1]),
    "angled": (angled(), [(0.2, 0.0166, 0.015), (0.0166, 0.2, 0.015)]),
    "notched": (cut_bar(lambda x: (abs(x[:, 0] - 0.155) > 0.005) | (x[:, 1] < -0.01)), ENDS),
    "neck at the root": (cut_bar(lambda x: (x[:, 0] > 0.01) | (abs(x[:, 1]) < 0.005)), ENDS),
    "pin aside": (
        cut_bar(
            lambda x: (x[:, 1] < 0.03) | (abs(x[:, [0, 2]] - [0.135, 0.0]).max(axis=1) < 0.005),
            (0.15, 0.05, 0.03), (15, 5, 3), 0.0,
        ),
        [(0.0, 0.015, 0.0), (0.135, 0.05, 0.0)],
    ),
    "cheeks": (
        cut_bar(
            lambda x: np.maximum(abs(abs(x[:, 0] - 0.15) - 0.12), abs(x[:, 1])) > 0.015,
            (0.3, 0.06, 0.02), (40, 8, 2), -0.03,
        ),
        [(0.03, 0.0, 0.0), (0.27, 0.0, 0.0)],
    ),
    "zigzag": (
        cut_bar(
            lambda x: (x[:, 0] // 0.01 % 2 == 0) | (np.where(x[:, 0] // 0.02 % 2 == 0, 1, -1) * x[:, 1] > 0.005),
            (0.21, 0.03, 0.02), (42, 6, 2),
        ),
        [(0.0, 0.0, 0.0), (0.21, 0.0, 0.0)],
    ),
    "plate": (box_tets((10, 10, 2), (0.1, 0.1, 0.01)), [(0.01, 0.05, 0.01), (0.09, 0.05, 0.01)]),
    "two bars": (
        cut_bar(lambda x: (abs(x[:, 1]) > 0.01) | (abs(x[:, 0] - 0.15) > 0.125), (0.3, 0.04, 0.02), (24, 8, 2), -0.02),
        ENDS,
    ),
}  # fmt: skip


@pytest.mark.parametrize("solid, places", AWKWARD.values(), ids=AWKWARD.keys())
def test_the_deflection_of_awkward_bodies_is_below_the_bound(solid, places):
    found = ratios(solid, places, 2)
    assert (found >= OVERSHOOT).all(), found


def test_a_body_without_children_deflects_most_at_its_far_end():
    solid, far = bar(), (0.3, 0.015, 0.015)
    load_envelope = loads(np.random.default_rng(0), 1)
    alone = static_reach(body_of(surface_of(solid)), anchors_of(ENDS[:1], 1), load_envelope)
    assert alone.displacement_m > OVERSHOOT * finite_elements(solid, anchors_of([ENDS[0], far], 1), load_envelope)[0]


def test_a_stiffer_material_deflects_less_and_a_longer_lever_arm_more():
    soft, steel = plain(), plain(material=STEEL)
    assert 0.0 < steel.displacement_m < 0.1 * soft.displacement_m
    body, anchors = body_of(box((0.3, 0.03, 0.03), (0.0, -0.015, -0.015))), anchors_of(ENDS, 2)
    load_envelope = loads(np.random.default_rng(0), 2)
    near, far = (
        static_reach(body, anchors, replace(load_envelope, target_distance=np.array([0.0, r]))) for r in (0.0, 1.0)
    )
    assert far.displacement_m == pytest.approx(near.displacement_m + far.rotation) and far.rotation == near.rotation


def test_at_rest_no_body_deflects():
    still = LoadEnvelope(*np.zeros((3, 3)), *np.zeros((2, 2, 3)))
    body = body_of(box((0.3, 0.03, 0.03), (0.0, -0.015, -0.015)))
    assert static_reach(body, anchors_of(ENDS, 2), still) == Stiffness(0.0, 0.0)


def test_anchors_at_the_root_do_not_move():
    body = body_of(box((0.3, 0.03, 0.03), (0.0, -0.015, -0.015)))
    load_envelope = loads(np.random.default_rng(0), 2)
    found = [static_reach(body, anchors_of(places, 2), load_envelope) for places in (ENDS, [*ENDS, ENDS[0]])]
    assert found[0] == found[1]


def test_a_body_that_is_not_a_beam_has_no_estimate():
    whole = box((0.3, 0.03, 0.03), (0.0, -0.015, -0.015))
    thin = tube((0.3, 0.03, 0.03), 0.002)
    refused = {
        "thin walls": plain((thin[0] - [0.0, 0.015, 0.015], thin[1])),
        "open": plain((whole[0], whole[1][1:])),
        "two parts": plain(joined(whole, box((0.1, 0.1, 0.1), (1.0, 0.0, 0.0)))),
        "inside out": plain(inside_out(whole)),
        "mesh file": plain(mesh_file="link.stl"),
        "rubbish": plain(material=replace(PLASTIC, youngs_modulus=0.0)),
        "wide": plain(box((0.3, 0.6, 0.03), (0.0, -0.3, -0.015))),
        "beside the body": plain((whole[0] + [0.0, 0.2, 0.0], whole[1])),
        "bow": plain(surface_of(cut_bar(lambda x: (x[:, 1] > 0.1) | (abs(x[:, 0] - 0.15) > 0.12), (0.3, 0.13, 0.03)))),
    }
    assert [name for name, found in refused.items() if found is not None] == []
    assert plain() is not None


def test_bodies_of_closed_chains_have_no_estimate():
    body = body_of(box((0.3, 0.03, 0.03), (0.0, -0.015, -0.015)))
    load_envelope = replace(loads(np.random.default_rng(0), 2), closed_chain=True)
    assert static_reach(body, anchors_of(ENDS, 2), load_envelope) is None


def test_it_does_not_depend_on_the_orientation_of_the_body_frame():
    turn = rotated(np.array([1.0, 0.0, 0.0]), np.pi / 2)  # peaks are along axes: only quarter turns keep them
    points, triangles = box((0.3, 0.02, 0.03), (0.0, -0.01, -0.015))
    load_envelope = loads(np.random.default_rng(0), 2)
    turned = LoadEnvelope(
        *(abs(value @ turn.T) for value in _vectors(load_envelope)), 3.0, load_envelope.target_distance
    )
    found = [
        static_reach(body_of((p, triangles)), anchors_of(ENDS, 2), e)
        for p, e in ((points, load_envelope), (points @ turn.T, turned))
    ]
    assert found[0].displacement_m == pytest.approx(found[1].displacement_m, rel=1e-6)


def _vectors(item):
    return item.acceleration, item.angular_acceleration, item.angular_velocity, item.force, item.moment
