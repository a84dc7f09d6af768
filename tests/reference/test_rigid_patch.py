"""Reduced links of large deflection against their unreduced meshes, with a rigid patch at the end."""

import numpy as np
import pytest
from boxes import box_tets, hollow_shaft
from calmotion.model import ElasticMaterial, FlexibleSettings
from calmotion.reduction.basis.craig_bampton import reduced_basis
from calmotion.reduction.basis.modal_derivatives import Support
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.material_laws.large_deflection import large_deflection
from calmotion.reduction.material_laws.reduced_poses import equilibrium
from full_order import FullOrder
from rigid_patch import pull

LENGTH, WIDE, HIGH = 0.3, 0.03, 0.02
TIP = np.array([LENGTH, 0.0, 0.0])
MATERIAL = ElasticMaterial("/Looks/Plastic", 2e9, 0.35, 1200.0, damping_ratio=0.0)


def ends(nodes):
    """The clamped face, and a last element that is rigid through and through."""
    return np.flatnonzero(nodes[:, 0] < 1e-9), np.flatnonzero(nodes[:, 0] > LENGTH * 11 / 12 - 1e-9)


@pytest.fixture(scope="module", params=[TIP, TIP + [0.0, 2.0 * WIDE, 0.0]], ids=["at its middle", "beside it"])
def link(request):
    """A link, reduced, and its mesh; its last element turns about a point in its middle or outside of it."""
    center = request.param
    points, tets = box_tets((12, 2, 1), (LENGTH, WIDE, HIGH), (0.0, -WIDE / 2, -HIGH / 2))
    model = assemble(points, tets, MATERIAL)
    root, patch = ends(model.mesh.nodes)
    support = Support(root, [patch], [center])
    basis = reduced_basis(model, root, [patch], [center], FlexibleSettings(MATERIAL))
    reduced, law = large_deflection(model, support, basis, MATERIAL, "stvk", tolerance=1e-6)
    return reduced, law.data, FullOrder(points, tets, 2e9, 0.35, 1200.0), center


@pytest.mark.parametrize("force", [(300.0, 0.0, 200.0), (-200.0, 60.0, 80.0)])
def test_a_reduced_link_deflects_like_its_mesh(link, force):
    """Under tension and under compression: by 22 to 34 mm of 300 mm."""
    reduced, data, full, center = link
    moved, turn = pull(full, *ends(full.nodes), center, force)
    motion = reduced.patch_motion[0]
    r = motion.shape[1]
    u = equilibrium(data.reshape(r + r * (r + 1) // 2, -1), np.asarray(force) @ motion[:3], np.zeros(r), steps=6)
    distance, angle = np.linalg.norm(moved), np.linalg.norm(turn)
    assert 0.02 < distance < 0.06
    assert np.allclose(motion[:3] @ u, moved, rtol=0, atol=2e-4 * distance)
    assert np.allclose(motion[3:] @ u, np.sin(angle) / angle * turn, rtol=0, atol=2e-3 * angle)


def check(points, tets, model, root, patch, center, forces):
    """The reduction moves a patch as the mesh does, by more than three degrees."""
    basis = reduced_basis(model, root, [patch], [center], FlexibleSettings(MATERIAL))
    support, full = Support(root, [patch], [center]), FullOrder(points, tets, 2e9, 0.35, 1200.0)
    reduced, law = large_deflection(model, support, basis, MATERIAL, "stvk", tolerance=1e-6)
    motion = reduced.patch_motion[0]
    r = motion.shape[1]
    for force in np.array(forces):
        moved, turn = pull(full, root, patch, center, force)
        u = equilibrium(law.data.reshape(r + r * (r + 1) // 2, -1), force @ motion[:3], np.zeros(r), steps=6)
        distance, angle = np.linalg.norm(moved), np.linalg.norm(turn)
        assert angle > 0.05
        assert np.allclose(motion[:3] @ u, moved, rtol=0, atol=1e-4 * distance)
        assert np.allclose(motion[3:] @ u, np.sin(angle) / angle * turn, rtol=0, atol=1e-4 * angle)


def test_a_shaft_in_a_ring_deflects_like_its_mesh():
    """By 10 degrees: what it twists and bends within the ring would be a thousandth of that."""
    points, tets = hollow_shaft(0.01, 0.1, (1, 8, 10))
    model = assemble(points, tets, MATERIAL)
    nodes, surface = model.mesh.nodes, model.mesh.surface
    held = (np.hypot(*nodes[:, :2].T) > 0.9e-2) & (nodes[:, 2] > 0.09 - 1e-9)
    root, patch = np.flatnonzero(nodes[:, 2] < 1e-9), np.unique(surface[held[surface[:, :3]].all(axis=1)])
    center = np.array([0.0, 0.02, 0.095])
    check(points, tets, model, root, patch, center, [(300.0, -300.0, -200.0)])


def test_a_link_with_a_rounded_end_deflects_like_its_mesh():
    """By four degrees. Without the smallest change of shape of the end it would be up to a hundredth too stiff."""
    points, tets = box_tets((8, 2, 2), (0.2, WIDE, WIDE), (0.0, -WIDE / 2, -WIDE / 2))
    end, radii = points[:, 0] > 0.2 - 1e-9, np.hypot(points[:, 1], points[:, 2]) / WIDE
    points[end, 0] += 0.008 - 0.024 * radii[end] ** 2
    model = assemble(points, tets, MATERIAL)
    nodes, corners = model.mesh.nodes, model.mesh.surface[:, :3]
    root = np.flatnonzero(nodes[:, 0] < 1e-9)
    patch = np.unique(model.mesh.surface[np.isin(corners, np.flatnonzero(end)).all(axis=1)])
    check(points, tets, model, root, patch, nodes[patch].mean(axis=0), [(-300.0, 300.0, 400.0)])
