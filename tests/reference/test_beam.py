"""Beams with analytic solutions: frequencies of a clamped beam, and deflection under its own weight."""

import numpy as np
import pytest
from beams import timoshenko_frequencies
from calmotion.mesh.tetrahedra import oriented_tets
from calmotion.model import ElasticMaterial
from calmotion.reduction.basis.natural_modes import SparseSolver, clamped_modes, vector_mass
from calmotion.reduction.elements.assembly import assemble

SLENDER = np.array([3.5160, 22.0345, 61.6972])


def beam(counts, length, height, material):
    """A square beam along x, and the nodes of its clamped end."""
    from skfem import MeshTet

    half = np.linspace(-0.5 * height, 0.5 * height, counts[1] + 1)
    mesh = MeshTet.init_tensor(np.linspace(0.0, length, counts[0] + 1), half, half)
    points = np.ascontiguousarray(mesh.p.T)
    model = assemble(points, oriented_tets(points, mesh.t.T)[0], material)
    return model, np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9)


def test_the_first_three_bending_frequencies_of_a_steel_beam_of_twenty_to_one():
    """Within 0.5% of Timoshenko's beam for all three, and within 1% of the slender limit for the first two.

    At 20 to 1 shear and rotary inertia lower the third frequency by 2.7% against the slender limit.
    """
    steel = ElasticMaterial("/Looks/Steel", 2.1e11, 0.3, 7850.0)
    length, height = 1.0, 0.05
    model, clamped = beam((40, 2), length, height, steel)
    f = clamped_modes(model, 8, clamped)[0]
    bending = f[[0, 1, 2, 3, 4, 5]].reshape(3, 2).mean(axis=1)
    assert np.allclose(f[0:6:2], f[1:6:2], rtol=2e-3)  # pairs: the beam is square
    slender = SLENDER * np.sqrt(2.1e11 * height**2 / 12.0 / (7850.0 * length**4)) / (2.0 * np.pi)
    theory = timoshenko_frequencies(steel, length, height, 3)
    # a clamped face may not contract as the beam's sections do: 4 parts in 1000 stiffer
    assert np.allclose(bending, theory, rtol=5e-3) and (bending > theory).all()
    assert np.allclose(bending[:2], slender[:2], rtol=1e-2)
    assert 0.96 < bending[2] / slender[2] < 0.98


def test_the_slender_limit():
    """At 100 to 1 all three are within 0.5% of the slender limit, without a correction."""
    steel = ElasticMaterial("/Looks/Steel", 2.1e11, 0.3, 7850.0)
    model, clamped = beam((100, 1), 1.0, 0.01, steel)
    f = clamped_modes(model, 6, clamped)[0].reshape(3, 2).mean(axis=1)
    slender = SLENDER * np.sqrt(2.1e11 * 1e-4 / 12.0 / 7850.0) / (2.0 * np.pi)
    assert np.allclose(f, slender, rtol=5e-3)


@pytest.mark.parametrize(("poissons_ratio", "tolerance"), [(0.0, 5e-4), (0.3, 1.5e-2)])
def test_a_cantilever_sags_under_its_own_weight(poissons_ratio, tolerance):
    """Beam theory: rho g A L^4 / 8 E I = 14.715 mm, and rho g L^2 / 2 k G more by shear (k = 5/6).

    Without lateral contraction beam theory is what the solid does. With it, the clamped face may not contract as the
    beam's sections do, and at 10 to 1 the solid is one per cent stiffer.
    """
    rubber = ElasticMaterial("/Looks/Rubber", 1e8, poissons_ratio, 1000.0)
    model, clamped = beam((20, 2), 1.0, 0.1, rubber)
    n = len(model.mesh.nodes)
    free = np.setdiff1d(np.arange(n), clamped)
    dofs = (3 * free[:, None] + np.arange(3)).ravel()
    load = vector_mass(model.mass) @ np.tile([0.0, 0.0, -9.81], n)
    u = np.zeros(3 * n)
    u[dofs] = SparseSolver(model.stiffness[dofs][:, dofs]).solve(load[dofs])
    tip = int(np.linalg.norm(model.mesh.nodes - [1.0, 0.0, 0.0], axis=1).argmin())
    bending = 1000.0 * 9.81 * 0.01 / (8.0 * 1e8 * 0.1**4 / 12.0)
    shear = 1000.0 * 9.81 / (2.0 * 5.0 / 6.0 * 1e8 / (2.0 * (1.0 + poissons_ratio)))
    assert bending == pytest.approx(14.715e-3, rel=1e-4)
    assert -u[3 * tip + 2] == pytest.approx(bending + shear, rel=tolerance)
