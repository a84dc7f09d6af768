"""A body held to a subspace: every term of it is that of the whole body at u = T w."""

from dataclasses import replace

import numpy as np
import pytest
from boxes import box_tets, fe_mesh
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.model import Body, FlexibleSettings, Frame
from calmotion.reduction.reduce import reduce_body
from calmotion.reduction.reduced_body import Elasticity, Invariants, Marker, ReducedBody
from calmotion.reduction.subspace import principal_subspace, projected_body
from law_call import call_neohookean, call_stvk

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def of_particles(weight, X, phi, stiffness, damping):
    """A body of particles, its integrals by their definitions."""
    marker = Marker(X[-1], IDENTITY, phi[-1], 0.3 * phi[0])
    integrals = Invariants(
        weight.sum(), weight @ X, np.einsum("n,ni,nj->ij", weight, X, X), np.einsum("n,nik,nil->kl", weight, phi, phi),
        np.einsum("n,nik->ki", weight, phi), np.einsum("n,ni,njk->kij", weight, X, phi),
        np.einsum("n,nik,njl->klij", weight, phi, phi),
    )  # fmt: skip
    return ReducedBody(integrals, stiffness, damping, (marker,), (phi[:2],))


@pytest.fixture
def particles(rng):
    weight, X = rng.uniform(0.1, 1.0, 12), rng.normal(size=(12, 3))
    phi = np.linalg.qr(np.sqrt(np.repeat(weight, 3))[:, None] * rng.normal(size=(36, 5)))[0]
    phi = (phi / np.sqrt(np.repeat(weight, 3))[:, None]).reshape(12, 3, 5)  # of unit mass
    damping = rng.normal(size=(5, 5))
    return weight, X, phi, np.array([1.0, 4.0, 30.0, 200.0, 900.0]), damping @ damping.T


@pytest.fixture
def rng():
    return np.random.default_rng(8)


def flexible(law, material):
    points, tets = box_tets((12, 1, 1), (0.6, 0.02, 0.02), (0.0, -0.01, -0.01))
    settings = FlexibleSettings(material, mode_count=6, elasticity=law)
    attachments = [
        AttachmentFrame(f"/C/{x}", Frame(np.array([x, 0.0, 0.0]), IDENTITY), "interface") for x in (0.0, 0.6)
    ]
    body = Body("/C/Arm", Frame(np.zeros(3), IDENTITY), None, flexible=settings)
    return reduce_body(fe_mesh(points, tets), body, attachments, (), 0)


def forces(body, u, v):
    """Elastic and viscous forces, and their derivatives."""
    r, law = len(u), body.elasticity
    res, P, K = np.zeros(6 + r), np.zeros((6 + r, 6 + r)), np.zeros((6 + r, 6 + r))
    if law.law == "stvk":
        p = r if law.strain_projection is None else len(law.strain_projection)
        call_stvk(
            law.data.reshape(r + p * (p + 1) // 2, -1), u, v, law.retardation, True, res, P, K, law.strain_projection
        )
    else:
        call_neohookean(law.points, u, v, law.lame, law.retardation, law.data, True, res, P, K)
    return res[6:], P[6:, 6:], K[6:, 6:]


def test_the_integrals_are_those_of_the_combined_modes(particles, rng):
    weight, X, phi, stiffness, damping = particles
    body = of_particles(*particles)
    T = principal_subspace(body, rng.normal(size=(3, 5)), 1e-9)
    assert T.shape == (5, 3)
    held, direct = projected_body(body, T), of_particles(weight, X, phi @ T, stiffness, damping)
    for name in ("mass", "s", "Z", "M", "M3", "M4", "S"):
        np.testing.assert_allclose(getattr(held.invariants, name), getattr(direct.invariants, name), atol=1e-13)
    np.testing.assert_allclose(held.invariants.M, np.eye(3), atol=1e-13)
    np.testing.assert_allclose(np.diag(held.stiffness), T.T @ np.diag(stiffness) @ T, atol=1e-11)
    np.testing.assert_allclose(held.damping, T.T @ damping @ T, atol=1e-13)
    np.testing.assert_allclose(held.markers[0].Phi, direct.markers[0].Phi, atol=1e-13)
    np.testing.assert_allclose(held.markers[0].Psi, direct.markers[0].Psi, atol=1e-13)
    np.testing.assert_allclose(held.skin[0], direct.skin[0], atol=1e-13)


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_forces_are_those_of_the_whole_body_along_the_subspace(law, plastic, rng):
    body = flexible(law, plastic)
    r = len(body.stiffness)
    amplitudes = 0.02 * body.stiffness[0] / body.stiffness
    T = principal_subspace(body, amplitudes * rng.normal(size=(4, r)), 1e-9)
    held = projected_body(body, T)
    w, rate = 1e-3 * rng.normal(size=4), 0.1 * rng.normal(size=4)
    few, many = forces(held, w, rate), forces(body, T @ w, T @ rate)
    for own, whole in zip(few, (T.T @ many[0], T.T @ many[1] @ T, T.T @ many[2] @ T), strict=True):
        np.testing.assert_allclose(own, whole, rtol=1e-9, atol=1e-9 * np.abs(whole).max())


def test_a_subspace_contains_its_motion_up_to_the_allowed_error(particles, rng):
    body = of_particles(*particles)
    motion = rng.normal(size=(50, 5)) * np.array([1.0, 0.3, 1e-2, 1e-4, 1e-6])
    counts = []
    for missing in (0.5, 1e-1, 1e-2, 1e-4, 1e-9):
        T = principal_subspace(body, motion, missing)
        # what is nearest by strain energy; directions are orthogonal by it too
        nearest = motion @ (body.stiffness[:, None] * T / np.einsum("jk,j,jk->k", T, body.stiffness, T)) @ T.T
        energy = np.sum((motion - nearest) ** 2 * body.stiffness) / np.sum(motion**2 * body.stiffness)
        assert energy <= missing**2
        counts.append(T.shape[1])
        np.testing.assert_allclose(T.T @ T, np.eye(T.shape[1]), atol=1e-12)
        K = T.T @ (body.stiffness[:, None] * T)
        np.testing.assert_allclose(K, np.diag(np.diag(K)), atol=1e-10 * K.max())
    assert counts == sorted(counts) and counts[0] < counts[-1] == 5


def test_a_body_at_rest_is_rigid(particles):
    body = of_particles(*particles)
    T = principal_subspace(body, np.zeros((7, 5)), 1e-3)
    assert T.shape == (5, 0) and len(projected_body(body, T).stiffness) == 0


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_strain_subspace_of_a_body_stays_the_same_in_a_pod_subspace(particles, rng, count):
    fields = rng.normal(size=(5 + 6, 15))
    law = Elasticity("stvk", 0.1, (fields @ fields.T).ravel(), strain_projection=rng.normal(size=(3, 5)))
    body = replace(of_particles(*particles), elasticity=law)
    T = principal_subspace(body, rng.normal(size=(count, 5)), 1e-12)
    held = projected_body(body, T)
    assert (held.elasticity.strain_projection is None) == (count <= 3)
    w, rate = rng.normal(size=count), rng.normal(size=count)
    few, many = forces(held, w, rate), forces(body, T @ w, T @ rate)
    for own, whole in zip(few, (T.T @ many[0], T.T @ many[1] @ T, T.T @ many[2] @ T), strict=True):
        np.testing.assert_allclose(own, whole, rtol=1e-9, atol=1e-9 * np.abs(whole).max())
