"""Patches along whose rims a mesh is cut: the same part of the surface for every mesh."""

import numpy as np
import pytest
from calmotion.mesh.bisection import bisected
from calmotion.mesh.patches.cut_patches import _cut_to_area, _within, with_rims
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.mesh.tetrahedra import surface_area, tet_volumes
from calmotion.model import Body, FlexibleSettings
from calmotion.model.meshes import CutPatch
from calmotion.reduction.basis.natural_modes import clamped_modes
from calmotion.reduction.elements.assembly import assemble

SIZE, RADIUS = (0.3, 0.02, 0.02), 0.016


@pytest.fixture(scope="module")
def frames(helpers):
    return [AttachmentFrame("/Arm/root", helpers.frame(0.01, 0.01, 0.01), "interface")]


@pytest.fixture(scope="module")
def beam(helpers, plastic):
    return Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic, interface_radius=RADIUS))


def patch_of(points, tets, rims, frames):
    mesh = quadratic_mesh(points, tets)
    cut = [CutPatch(center, rim) for center, rim in rims]
    (patch,) = interface_patches(mesh, frames, RADIUS, "/Arm/link", cut)
    whole = np.isin(mesh.surface, patch.nodes).all(axis=1)
    return mesh, patch, surface_area(mesh.nodes, mesh.surface[whole][:, :3])


def exact_area():
    """Of the sides and the end of the box within the sphere about a point 10 mm below the middle of its end."""
    x = np.linspace(-RADIUS, RADIUS, 2001)
    x = 0.5 * (x[1:] + x[:-1])
    y, z = np.meshgrid(x, x)
    far = np.sqrt(y**2 + z**2 + 0.01**2)
    cell = (2.0 * RADIUS / 2000) ** 2
    end = ((far <= RADIUS) & (np.abs(y) <= 0.01) & (np.abs(z) <= 0.01)).sum()
    side = ((far <= RADIUS) & (np.abs(y) <= 0.01) & (z >= -0.01)).sum()
    return cell * (end + 4 * side)


@pytest.mark.parametrize("counts", [(10, 1, 1), (12, 1, 1), (20, 1, 1), (24, 2, 2)])
def test_the_patch_has_the_area_within_the_sphere_and_keeps_it_when_elements_are_refined(helpers, beam, frames, counts):
    points, tets = helpers.box(counts, SIZE)
    points, tets, rims = with_rims(np.asarray(points), tets, beam, frames)
    assert tet_volumes(points, tets).sum() == pytest.approx(np.prod(SIZE), rel=1e-9)
    held = [(center, points[triangles]) for center, triangles in rims]
    _, patch, area = patch_of(points, tets, held, frames)
    assert area == pytest.approx(exact_area(), rel=0.01)
    near = np.flatnonzero(np.linalg.norm(points[tets].mean(axis=1), axis=1) < 2 * RADIUS)
    _, finer, same = patch_of(*bisected(points, tets, near)[:2], held, frames)
    assert len(finer.nodes) > len(patch.nodes) and same == pytest.approx(area, rel=1e-9)


def test_frequencies_hardly_depend_on_where_the_elements_are(helpers, beam, frames):
    """With whole elements near the joint as a patch, these two meshes differ by more than three percent."""

    def first(counts, is_cut):
        points, tets = helpers.box(counts, SIZE)
        rims = ()
        if is_cut:
            points, tets, rims = with_rims(np.asarray(points), tets, beam, frames)
        model = assemble(points, tets, beam.flexible.material)
        cut = [CutPatch(center, points[triangles]) for center, triangles in rims]
        (patch,) = interface_patches(model.mesh, frames, RADIUS, "/Arm/link", cut)
        return clamped_modes(model, 1, patch.nodes)[0][0]

    counts = [(8, 1, 1), (12, 1, 1)]
    whole, along = ([first(count, is_cut) for count in counts] for is_cut in (False, True))
    assert abs(whole[1] / whole[0] - 1.0) > 0.02 and along[1] == pytest.approx(along[0], rel=0.006)


def test_patches_that_would_meet_keep_their_parts_when_elements_are_refined(helpers, plastic):
    """The spheres about two joints overlap; each holds what is nearer to it, on any elements."""
    size, at = (0.06, 0.06, 0.005), ((-0.01, 0.0, 0.025), (0.01, 0.0, 0.025))
    body = Body("/Arm/plate", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic, interface_radius=0.027))
    frames = [AttachmentFrame(f"/Arm/{k}", helpers.frame(*p), "interface") for k, p in enumerate(at)]
    points, tets = helpers.box((8, 8, 1), size, origin=(-0.03, -0.03, 0.0))
    points, tets, rims = with_rims(np.asarray(points), tets, body, frames)
    assert tet_volumes(points, tets).sum() == pytest.approx(np.prod(size), rel=1e-3) and len(rims) == 2
    cut = [CutPatch(center, points[triangles]) for center, triangles in rims]
    held = []
    for _ in range(3):
        mesh = quadratic_mesh(points, tets)
        found = interface_patches(mesh, frames, 0.027, "/Arm/plate", cut)
        whole = [np.isin(mesh.surface, patch.nodes).all(axis=1) for patch in found]
        assert not np.intersect1d(found[0].nodes, found[1].nodes).size
        held.append([surface_area(mesh.nodes, mesh.surface[own][:, :3]) for own in whole])
        points, tets, _ = bisected(points, tets, np.arange(len(tets), dtype=np.int32))
    assert held[1] == pytest.approx(held[0], rel=1e-9) and held[2] == pytest.approx(held[0], rel=1e-9)
    # places in the cells of a fine grid on the upper side: nearer by the ratio, and in the sphere
    x = np.linspace(-0.03, 0.03, 1201)
    x, y = np.meshgrid(0.5 * (x[1:] + x[:-1]), 0.5 * (x[1:] + x[:-1]))
    away = [np.sqrt((x - p[0]) ** 2 + y**2 + 0.02**2) for p in at]
    exact = ((away[0] <= 0.45 / 0.55 * away[1]) & (away[0] <= 0.027)).sum() * (0.06 / 1200) ** 2
    lower = np.sqrt((x - at[0][0]) ** 2 + y**2 + 0.025**2), np.sqrt((x - at[1][0]) ** 2 + y**2 + 0.025**2)
    exact += ((lower[0] <= 0.45 / 0.55 * lower[1]) & (lower[0] <= 0.027)).sum() * (0.06 / 1200) ** 2
    assert held[0][0] == pytest.approx(exact, rel=0.05)


def test_a_sphere_that_passes_along_a_wall_has_its_area_too(helpers, plastic):
    """The side of a bar is nearly on the sphere: whole elements of it are inside, or none."""
    body = Body("/Arm/bar", helpers.frame(0, 0, 0), None, flexible=FlexibleSettings(plastic, interface_radius=0.0155))
    frames = [AttachmentFrame("/Arm/root", helpers.frame(0.15, 0.015, 0.015), "interface")]
    for counts in ((9, 2, 2), (14, 2, 2), (20, 3, 3)):
        points, tets = helpers.box(counts, (0.3, 0.03, 0.03))
        points, tets, ((_, triangles),) = with_rims(np.asarray(points), tets, body, frames)
        # four caps of the sphere on the sides: its center is 15 mm from each
        assert surface_area(points, triangles) == pytest.approx(4.0 * np.pi * (0.0155**2 - 0.015**2), rel=0.03)


@pytest.mark.parametrize("apart", [0.012, 0.016, 0.02])
def test_a_patch_keeps_its_area_where_the_sphere_of_another_one_crosses_it(helpers, apart):
    """A shoulder of the G1 lost 9% of its patch to the cut for its other joint, and its mirror image nothing."""
    points, tets = helpers.box((11, 11, 3), (0.06, 0.06, 0.012), origin=(-0.03, -0.03, -0.012))
    first, second = (np.zeros(3), 0.011), (np.array([apart, 0.003, 0.012]), 0.02)
    points, tets, radius = _cut_to_area(np.asarray(points), tets, *first)
    area = surface_area(points, _within(points, tets, first[0], radius))
    assert area == pytest.approx(np.pi * first[1] ** 2, rel=0.02)
    held = []
    for done in ([], [(first[0], radius)]):
        made, split, _ = _cut_to_area(points, tets, *second, done)
        assert tet_volumes(made, split).sum() == pytest.approx(0.06 * 0.06 * 0.012, rel=1e-3)
        held.append(surface_area(made, _within(made, split, first[0], radius)))
    assert abs(held[1] / area - 1.0) < 1e-9 < abs(held[0] / area - 1.0)


@pytest.mark.parametrize("turned", [0.0, 0.3, 0.6])
def test_the_rim_is_round_where_the_joint_is_far_from_the_surface(helpers, plastic, turned):
    """A sphere four times as large as the disc that it cuts, on elements as large as the disc."""
    away, disc = 0.04, 0.01
    frames = [AttachmentFrame("/Arm/root", helpers.frame(0.0, 0.0, -away), "interface")]
    settings = FlexibleSettings(plastic, interface_radius=float(np.hypot(away, disc)))
    body = Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=settings)
    points, tets = helpers.box((4, 4, 1), (0.08, 0.08, 0.02), origin=(-0.04, -0.04, 0.0))
    c, s = np.cos(turned), np.sin(turned)
    points = np.asarray(points) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + [3e-3, 1e-3, 0.0]
    points, _, ((_, rim),) = with_rims(points, tets, body, frames)
    area, corners = surface_area(points, rim), points[rim]
    assert area == pytest.approx(np.pi * disc**2, rel=0.01)
    middle = np.einsum("t,tx->x", np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]),
                                                 axis=1), corners.mean(axis=1)) / (2.0 * area)  # fmt: skip
    assert np.linalg.norm(middle) < 0.03 * disc
    edges = np.sort(rim[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    outer = np.array([edge for edge, count in zip(*np.unique(edges, axis=0, return_counts=True), strict=True)
                      if count == 1])  # fmt: skip
    around = np.linalg.norm(points[outer[:, 0]] - points[outer[:, 1]], axis=1).sum()
    assert 4.0 * np.pi * area / around**2 > 0.985  # 0.95 of a regular octagon, 0.987 of one with 16 sides
