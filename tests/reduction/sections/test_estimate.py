"""Beams by sections against closed forms, and that no mesh is made for them."""

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.model import Body, FlexibleSettings, MassProperties, SurfaceMesh
from calmotion.reduction.sections import estimate

TURNED = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


def estimated_body(*given):
    return estimate.estimated_body(*given)[0]


def box(low, high, inward=False):
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))], dtype=np.int32)
    return np.asarray(low) + corners * (np.asarray(high) - low), triangles[:, ::-1] if inward else triangles


def link(material, *parts, mass=None, **settings):
    surfaces = tuple(SurfaceMesh(f"/Arm/link/s{k}", p, t) for k, (p, t) in enumerate(parts))
    return Body("/Arm/link", None, mass, surfaces=surfaces, flexible=FlexibleSettings(material, **settings))


def frames(helpers, *places):
    return [AttachmentFrame(f"/Arm/j{k}", helpers.frame(*place), "interface") for k, place in enumerate(places)]


def bending(material, length, second_moment, area):
    """First frequency of a clamped beam [Hz]."""
    stiffness = material.youngs_modulus * second_moment / (material.density * area)
    return 1.8751**2 / (2.0 * np.pi * length**2) * np.sqrt(stiffness)


@pytest.mark.parametrize("thin", [0.02, 0.004, 0.0005])
@pytest.mark.parametrize("turned", [False, True])
def test_a_bar_has_the_frequencies_of_a_clamped_beam(thin, turned, steel, helpers):
    points, triangles = box((0.0, -0.01, -0.5 * thin), (0.4, 0.01, 0.5 * thin))
    tip = np.array([0.4, 0.0, 0.0])
    if turned:
        turn = TURNED * np.sign(np.linalg.det(TURNED))
        points, tip = points @ turn.T, turn @ tip
    body = link(steel, (points, triangles))
    found = estimated_body(body, frames(helpers, (0.0, 0.0, 0.0), tip), 0)
    expected = bending(steel, 0.4, 0.02 * thin**3 / 12.0, 0.02 * thin)
    assert found.frequencies[0] == pytest.approx(expected, rel=0.1)
    assert found.invariants.mass == pytest.approx(steel.density * 0.4 * 0.02 * thin, rel=0.02)
    assert np.abs(found.markers[0].Phi).max() == 0.0


def test_what_a_link_carries_at_its_tip_is_held_by_the_static_stiffness(steel, helpers):
    body = link(steel, box((0.0, -0.01, -0.005), (0.4, 0.01, 0.005)))
    found = estimated_body(body, frames(helpers, (0.0, 0.0, 0.0), (0.4, 0.0, 0.0)), 0)
    tip = found.markers[1].Phi[2]
    compliance = float((tip**2 / found.stiffness).sum())
    assert compliance == pytest.approx(0.4**3 / (3.0 * steel.youngs_modulus * 0.02 * 0.01**3 / 12.0), rel=0.15)


@pytest.mark.parametrize("how", ["surfaces", "wall"])
def test_a_hollow_part_is_hollow(how, steel, helpers):
    """A square tube of 20 mm with a wall of 2 mm, by two surfaces and by a wall thickness."""
    outer = box((0.0, -0.01, -0.01), (0.5, 0.01, 0.01))
    inner = box((0.0, -0.008, -0.008), (0.5, 0.008, 0.008), inward=True)
    body = link(steel, outer, inner) if how == "surfaces" else link(steel, outer, wall_thickness=0.002)
    found = estimated_body(body, frames(helpers, (0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), 0)
    second, area = (0.02**4 - 0.016**4) / 12.0, 0.02**2 - 0.016**2
    assert found.frequencies[0] == pytest.approx(bending(steel, 0.5, second, area), rel=0.15)
    assert found.invariants.mass == pytest.approx(steel.density * area * 0.5, rel=0.15)


def test_two_arms_swing_for_themselves(steel, helpers):
    """A tee: a thick post, and on top of it two thin arms to both sides."""
    post = box((-0.02, -0.02, 0.0), (0.02, 0.02, 0.1))
    arms = box((-0.3, -0.01, 0.095), (0.3, 0.01, 0.1))
    found = estimated_body(link(steel, post, arms), frames(helpers, (0.0, 0.0, 0.0), (0.3, 0.0, 0.0975)), 0)
    expected = bending(steel, 0.28, 0.02 * 0.005**3 / 12.0, 0.02 * 0.005)
    assert found.frequencies[:2] == pytest.approx([expected] * 2, rel=0.25)


def test_a_stated_mass_counts_and_open_or_inverted_surfaces_do_not_matter(steel, helpers):
    points, triangles = box((0.0, -0.01, -0.01), (0.4, 0.01, 0.01))
    held = frames(helpers, (0.0, 0.0, 0.0), (0.4, 0.0, 0.0))
    whole = estimated_body(link(steel, (points, triangles)), held, 0)
    for other in (triangles[:, ::-1], triangles[:-1]):
        found = estimated_body(link(steel, (points, np.ascontiguousarray(other))), held, 0)
        assert found.frequencies[0] == pytest.approx(whole.frequencies[0], rel=0.05)
    heavy = MassProperties(4.0 * whole.invariants.mass, np.zeros(3), np.eye(3))
    found = estimated_body(link(steel, (points, triangles), mass=heavy), held, 0)
    assert found.frequencies[0] == pytest.approx(0.5 * whole.frequencies[0], rel=1e-6)


def test_a_body_without_geometry_is_a_beam_or_refused(steel, helpers):
    body = link(steel)
    held = frames(helpers, (0.0, 0.0, 0.0), (0.4, 0.0, 0.0))
    with pytest.raises(ShotError, match="no geometry"):
        estimated_body(body, held, 0)
    mass = MassProperties(0.3, np.array([0.2, 0.0, 0.0]), np.diag([1e-5, 4e-3, 4e-3]))
    assert estimated_body(replace(body, mass=mass), held, 0).frequencies[0] > 0.0


def test_inspect_neither_meshes_nor_loads_finite_elements(repository):
    code = (
        "import sys; from calmotion.cli.main import main; status = main(['inspect', *sys.argv[1:]]);"
        "loaded = {name.partition('.')[0] for name in sys.modules} & {'skfem', 'pytetwild', 'manifold3d'};"
        "print(status, sorted(loaded), file=sys.stderr)"
    )
    shot = repository / "samples" / "bartender" / "bartender.usda"
    command = [sys.executable, "-c", code, str(shot), "--json", "--quiet", "--step", "10ms"]  # no search for a step
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr.splitlines()[-1] == "0 []"
    report = json.loads(done.stdout)
    sources = {body["frequencies_from"] for body in report["bodies"] if body["simulated"] == "flexible"}
    assert sources <= {"sections", "earlier mesh"}
    assert report["system_frequencies_hz"][0] == pytest.approx(4.67, rel=0.2)
