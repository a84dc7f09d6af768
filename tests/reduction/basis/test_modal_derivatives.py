"""Modal derivatives against the second order of full nonlinear equilibria."""

import numpy as np
import pytest
from boxes import box_tets
from calmotion.model import FlexibleSettings
from calmotion.reduction.basis.craig_bampton import reduced_basis
from calmotion.reduction.basis.modal_derivatives import Support, extended_basis, modal_derivatives
from calmotion.reduction.basis.natural_modes import vector_mass
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.elastic_forms import LAW_ORDER, GradientRule, lame_constants, strain_gram
from calmotion.reduction.material_laws.reduced_poses import equilibrium

LENGTH, THICKNESS = 0.6, 0.02


@pytest.fixture(scope="module")
def arm(plastic):
    points, tets = box_tets((30, 1, 1), (LENGTH, THICKNESS, THICKNESS), (0.0, -THICKNESS / 2, -THICKNESS / 2))
    model = assemble(points, tets, plastic)
    x = model.mesh.nodes[:, 0]
    support = Support(np.flatnonzero(x < 1e-9), [np.flatnonzero(x > LENGTH - 1e-9)], [np.array([LENGTH, 0.0, 0.0])])
    basis = reduced_basis(
        model, support.root, support.patches, support.centers, FlexibleSettings(plastic, mode_count=8)
    )
    return model, support, basis, plastic


def test_a_deflected_beam_keeps_its_length(arm):
    """The derivative of a bending mode with itself draws the tip in by the integral of the slope squared."""
    model, support, basis, material = arm
    found = modal_derivatives(model, support, basis, 1, material, "stvk")
    fields, motion = found.fields, found.motion
    x = model.mesh.nodes[:, 0]
    axis = np.flatnonzero(np.all(np.abs(model.mesh.nodes[:, 1:]) < 1e-9, axis=1))
    axis = axis[np.argsort(x[axis])]
    assert len(axis) >= 15
    slope = np.gradient(basis.modes[axis, :, 0], x[axis], axis=0)
    drawn_in = -np.trapezoid(slope[:, 1] ** 2 + slope[:, 2] ** 2, x[axis])
    # x = theta u^2 / 2, and the shortening is that of half the slope squared
    assert motion[0, 0, 0] == pytest.approx(drawn_in, rel=0.01)
    assert np.abs(fields[support.root]).max() == 0.0


def test_a_patch_rotates_by_a_finite_rotation(arm):
    model, support, basis, material = arm
    found = modal_derivatives(model, support, basis, 1, material, "stvk")
    fields, motion = found.fields, found.motion
    patch = support.patches[0]
    arms = model.mesh.nodes[patch] - support.centers[0]
    turn = basis.patch_motion[0, 3:, 0]
    expected = np.cross(turn, np.cross(turn, arms)) + motion[0, :3, 0] + np.cross(motion[0, 3:, 0], arms)
    assert np.allclose(fields[patch, :, 0], expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_the_extended_basis_is_orthonormal_and_keeps_the_linear_modes(arm, law):
    model, support, basis, material = arm
    longer = extended_basis(model, support, basis, 4, material, law)
    flat = longer.modes.reshape(-1, len(longer.omega_squared))
    assert np.allclose(flat.T @ (vector_mass(model.mass) @ flat), np.eye(len(longer.omega_squared)), atol=1e-8)
    assert np.allclose(longer.omega_squared[:4], basis.omega_squared[:4], rtol=1e-4)
    assert 4 <= len(longer.omega_squared) - 8 <= 10
    # the patches' motion belongs to the modes
    patch = support.patches[0]
    center = np.flatnonzero(np.all(np.abs(model.mesh.nodes[patch] - support.centers[0]) < 1e-9, axis=1))
    assert len(center) == 1
    assert np.allclose(longer.patch_motion[0, :3], longer.modes[patch[center[0]]], atol=1e-7)


def test_without_them_the_arm_locks_and_with_them_it_does_not(arm):
    """With a deflection of 30 mm, linear modes alone give a third of the deflection."""
    model, support, basis, material = arm
    lame = lame_constants(material.youngs_modulus, material.poissons_ratio)
    force = 10.27  # 30.8 mm of a linear beam
    deflections = []
    for candidate in (basis, extended_basis(model, support, basis, 6, material, "stvk")):
        gram = strain_gram(GradientRule(model.mesh, LAW_ORDER), candidate.modes, *lame)
        u = equilibrium(gram, force * candidate.patch_motion[0, 2], np.zeros(len(candidate.omega_squared)), steps=6)
        deflections.append(candidate.patch_motion[0, :3] @ u)
    assert deflections[0][2] < 0.4 * deflections[1][2]
    assert deflections[1][2] == pytest.approx(30.64e-3, rel=0.015)
