"""Thin-walled and hollow parts at the automatic size against frequencies that are known otherwise."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from calmotion.mesh.tetrahedra import oriented_tets, without_unused_points
from calmotion.model import Frame
from calmotion.model.meshes import core_of
from calmotion.reduction.discretization_error import frequency_errors
from calmotion.reduction.elements.assembly import assemble
from calmotion.tolerance.meshes.options import MeshOptions
from mesher_links import FLEXIBLE, box, link, mesh_body, surface

MATERIAL = FLEXIBLE.material
E, NU, RHO = MATERIAL.youngs_modulus, MATERIAL.poissons_ratio, MATERIAL.density
ROOT = Frame(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))

pytestmark = pytest.mark.long


@pytest.fixture
def frequencies():
    def of(mesh, count=6, frames=(ROOT,), **fields):
        """First frequencies [Hz] of a part, held at its end, or free without frames."""
        body = replace(
            link(surface(mesh)), flexible=replace(FLEXIBLE, interface_radius=fields.pop("radius", -1.0), **fields)
        )
        made = mesh_body(body, MeshOptions(), frames)
        model = assemble(made.points, made.tets, MATERIAL)
        held = np.flatnonzero(np.abs(model.mesh.nodes[:, 0]) < 1e-5) if frames else None
        found = frequency_errors(model, MATERIAL, count, held)[0]
        print(len(model.mesh.nodes), np.round(found, 2), made.quality.frequency_error)
        return found

    return of


def timoshenko(area, second_moment, shear_area, length):
    """First frequency of a cantilever beam [Hz], by Rayleigh's quotient of bending and shear (Dunkerley)."""
    bending = 1.8751**4 * E * second_moment / (RHO * area * length**4)
    shear = (np.pi / 2.0) ** 2 * E / (2.0 * (1.0 + NU)) * shear_area / (RHO * area * length**2)
    return 1.0 / np.sqrt(1.0 / bending + 1.0 / shear) / (2.0 * np.pi)


def test_a_round_tube(frequencies):
    length, outer, wall = 0.3, 0.016, 2e-3
    bar = trimesh.creation.cylinder(outer, length, sections=64)
    bar.apply_transform(trimesh.geometry.align_vectors([0, 0, 1], [1, 0, 0]))
    bar.apply_translation([length / 2 - bar.bounds[0, 0] - length / 2, 0.0, 0.0])
    found = frequencies(bar, 2, wall_thickness=wall, section="tube")
    inner = outer - wall
    area, second = np.pi * (outer**2 - inner**2), np.pi / 4.0 * (outer**4 - inner**4)
    beam = timoshenko(area, second, area * 0.53, length)  # Cowper 1966: thin round tubes
    print(beam)
    assert found == pytest.approx(beam, rel=0.01)


def test_a_channel(frequencies):
    length, web, flange, wall = 0.4, 0.03, 0.02, 2e-3
    parts = [
        box((length, web, wall), at=(length / 2, 0.0, wall / 2)),
        *(box((length, wall, flange), at=(length / 2, side * (web - wall) / 2, flange / 2)) for side in (-1.0, 1.0)),
    ]
    found = frequencies(trimesh.boolean.union(parts, engine="manifold"), 4)
    # in its plane of symmetry it bends without torsion
    areas = np.array([(web - 2 * wall) * wall, 2 * wall * flange])
    heights = np.array([wall / 2, flange / 2])
    center = areas @ heights / areas.sum()
    own = np.array([(web - 2 * wall) * wall**3, 2 * wall * flange**3]) / 12.0
    second = float((own + areas * (heights - center) ** 2).sum())
    beam = timoshenko(areas.sum(), second, 2 * wall * flange / 1.2, length)
    print(beam)
    assert np.abs(found / beam - 1.0).min() < 0.01


def test_a_printed_bar(helpers):
    """Of a skin of 0.9 mm and 20% infill, against elements that end where the skin does."""
    length, width = 0.3, 0.02
    metal = replace(MATERIAL, core=core_of(0.2, 0.9e-3))
    bar = trimesh.creation.box(bounds=[(0.0, -width / 2, -width / 2), (length, width / 2, width / 2)])
    body = replace(link(surface(bar)), flexible=replace(FLEXIBLE, material=metal))
    made = mesh_body(body, MeshOptions(), (ROOT,))

    def first(points, tets):
        model = assemble(points, tets, metal)
        return frequency_errors(model, metal, 4, np.flatnonzero(np.abs(model.mesh.nodes[:, 0]) < 1e-5))[0]

    points, tets = helpers.box((42, 6, 6), (1.0, 1.0, 1.0))
    skin, follows = metal.core.skin, []
    for x, (low, high, count) in zip(
        np.asarray(points).T, [(0.0, length, 42), *[(-width / 2, width / 2, 6)] * 2], strict=True
    ):
        planes = np.array([low, *np.linspace(low + skin, high - skin, count - 1), high])
        follows.append(np.interp(x, np.linspace(0.0, 1.0, count + 1), planes))
    reference = first(np.stack(follows, axis=1), tets)
    found = np.sqrt(made.quality.stiffness_factor) * first(made.points, made.tets)
    print(found, reference, made.quality.frequency_error)
    assert found == pytest.approx(reference, rel=0.01)
    assert np.abs(found[:3] / reference[:3] - 1.0).max() < made.quality.frequency_error


def test_a_closed_box_of_plates(frequencies):
    """Against hexahedra of the walls, divided into tetrahedra: another mesh, of 40,000 elements in two layers."""
    from skfem import MeshTet

    size, wall = np.array([0.2, 0.06, 0.04]), 2.5e-3
    found = frequencies(box(size, at=(0.1, 0.0, 0.0)), 3, wall_thickness=wall)
    lines = []
    for side, parts, low in zip(size, (26, 10, 8), (0.0, -0.03, -0.02), strict=True):
        inner = np.linspace(wall, side - wall, parts + 1)
        lines.append(low + np.concatenate([[0.0, wall / 2], inner, [side - wall / 2, side]]))
    mesh = MeshTet.init_tensor(*lines)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    low, high = (np.array([edge[k] for edge in lines])[:, None] for k in (2, -3))
    tets = mesh.t.T[~((middle > low) & (middle < high)).all(axis=0)].astype(np.int32)
    points, tets = without_unused_points(mesh.p.T, oriented_tets(mesh.p.T, tets)[0])
    model = assemble(points, tets, MATERIAL)
    exact = frequency_errors(model, MATERIAL, 3, np.flatnonzero(np.abs(model.mesh.nodes[:, 0]) < 1e-9))[0]
    print(exact)
    assert found == pytest.approx(exact, rel=0.01)


def test_a_spherical_shell(frequencies):
    """The lowest spheroidal modes of a free shell, n = 2, five times: membrane theory, h / R = 0.06."""
    radius, wall = 0.05, 3e-3
    ball = trimesh.creation.icosphere(subdivisions=4, radius=radius + wall / 2)
    found = frequencies(ball, 5, (), wall_thickness=wall)
    b, c = 7.0 + 3.0 * NU, 4.0 * (1.0 - NU**2)
    shell = np.sqrt((b - np.sqrt(b**2 - 4.0 * c)) / 2.0 * E / (RHO * (1.0 - NU**2))) / radius / (2.0 * np.pi)
    print(shell, shell * np.sqrt(1.0 - NU**2))
    assert found == pytest.approx(shell, rel=0.01)
