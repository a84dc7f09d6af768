"""A quadratic strain that sees few directions, against one that sees all."""

import numpy as np
import pytest
from boxes import box_tets, fe_mesh
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.model import Body, FlexibleSettings, Frame
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.material_laws.reduced_poses import equilibrium
from calmotion.reduction.reduce import reduce_body

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
FORCE = np.array([0.3, 2.0, 1.0])


def loads(size):
    """Of a link that carries a weight at its end."""
    still = np.zeros(3)
    force, moment = np.array([still, size * FORCE]), np.zeros((2, 3))
    return LoadEnvelope(9.81 * np.ones(3), still, still, force, moment, 5.0, np.array([0.0, 0.3]))


def link(material, tolerance, load_envelope, **more):
    points, tets = box_tets((12, 2, 2), (0.3, 0.03, 0.04), (0.0, -0.015, -0.02))
    settings = FlexibleSettings(material, elasticity="stvk", mode_count=12, **more)
    attachments = [
        AttachmentFrame(f"/C/{x}", Frame(np.array([x, 0.0, 0.0]), IDENTITY), "interface") for x in (0.0, 0.3)
    ]
    body = Body("/C/Link", Frame(np.zeros(3), IDENTITY), None, flexible=settings)
    return reduce_body(fe_mesh(points, tets), body, attachments, (), 0, load_envelope, tolerance)


def whole_gram(body):
    """Gram matrix of all pairs of coordinates, as a body that sees some directions has them."""
    law, r = body.elasticity, len(body.stiffness)
    W = np.eye(r) if law.strain_projection is None else law.strain_projection
    p = len(W)
    first, second = np.triu_indices(p)
    k, l = np.triu_indices(r)
    pairs = W[first][:, k] * W[second][:, l] + np.where(k != l, W[first][:, l] * W[second][:, k], 0.0)
    L = np.zeros((r + len(first), r + len(k)))
    L[:r, :r], L[r:, r:] = np.eye(r), pairs
    return L.T @ law.data.reshape(len(L), len(L)) @ L


def tip(body, size):
    """Where the end of the link comes to rest under its load [m]."""
    marker = body.markers[1]
    load = marker.Phi.T @ (size * FORCE)
    return marker.Phi @ equilibrium(whole_gram(body), load, np.zeros(len(load)), steps=8)


@pytest.mark.parametrize("size", [pytest.param(60.0, marks=pytest.mark.long), 300.0])
def test_a_link_with_a_strain_subspace_deflects_like_one_with_the_full_quadratic_strain(plastic, size, monkeypatch):
    tolerance = 1e-5
    few = link(plastic, tolerance, loads(size))
    seen = few.elasticity.strain_projection
    assert seen is not None and 3 <= len(seen) < len(few.stiffness)
    monkeypatch.setattr(
        "calmotion.reduction.material_laws.large_deflection.quadratic_strain_subspace", lambda *arguments: None
    )
    every = link(plastic, tolerance, loads(size))
    assert every.elasticity.strain_projection is None
    np.testing.assert_allclose(few.stiffness, every.stiffness)
    own, whole = tip(few, size), tip(every, size)
    assert np.linalg.norm(own - whole) < 0.3 * tolerance
    # and all of that matters: the linear link is off by far more
    marker = every.markers[1]
    linear = marker.Phi @ (marker.Phi.T @ (size * FORCE) / every.stiffness)
    assert np.linalg.norm(linear - whole) > 2.0 * tolerance


def test_a_tighter_tolerance_has_a_larger_strain_subspace(plastic):
    counts = []
    for tolerance in (1e-3, 1e-5, 1e-7):
        law = link(plastic, tolerance, loads(30.0)).elasticity
        counts.append(10**6 if law.strain_projection is None else len(law.strain_projection))
    assert counts == sorted(counts) and counts[0] < counts[-1]


def test_rotations_of_interfaces_are_in_the_strain_subspace(plastic):
    body = link(plastic, 1e-4, loads(30.0))
    Psi, W = body.markers[1].Psi, body.elasticity.strain_projection
    assert np.linalg.lstsq(W.T, Psi.T, rcond=None)[1].sum() < 1e-18 * np.sum(Psi**2)


def test_simplifications_are_reported(plastic):
    body = link(plastic, 1e-4, loads(30.0))
    p, r = body.elasticity.strain_projection.shape
    row = body.left_out[-1]
    assert row.what == f"/C/Link: quadratic strain in {p} of {r} elastic coordinates"
    assert 0.0 < row.estimated_error_m <= 2.5e-5
