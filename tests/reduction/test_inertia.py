"""Inertia integrals against direct quadrature of Seed (4)-(9): docs/formulation.md, identities 1 and 2."""

import numpy as np
import pytest
from boxes import quadratic_shapes
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.inertia import inertia_integrals
from scipy.spatial.transform import Rotation

RELATIVE = 1e-12


def skew(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0.0]])


def axial(B):
    """int rho y x z from B = int rho y z^T."""
    return np.array([B[1, 2] - B[2, 1], B[2, 0] - B[0, 2], B[0, 1] - B[1, 0]])


def rotation(vector):
    return Rotation.from_rotvec(vector).as_matrix()


class Case:
    """A crooked body with random modes, sampled at quadrature points, and a random state."""

    def __init__(self, helpers, material, modes=5):
        rng = np.random.default_rng(7)
        points, tets = helpers.box((3, 2, 2), (0.4, 0.1, 0.2), origin=(0.3, -0.2, 0.1))
        points = points + 0.01 * rng.standard_normal(points.shape)
        self.model = assemble(points, tets, material)
        self.nodes = self.model.mesh.nodes
        self.Phi = rng.standard_normal((len(self.nodes), 3, modes))
        self.inv = inertia_integrals(self.nodes, self.model.mass, self.Phi)
        bary, weights = helpers.quadrature(points, tets, order=5)
        N = quadratic_shapes(bary)
        elements = self.model.mesh.tets
        self.rho = material.density * weights.ravel()
        self.X = np.einsum("qa,eai->eqi", N, self.nodes[elements]).reshape(-1, 3)
        self.phi = np.einsum("qa,eaij->eqij", N, self.Phi[elements]).reshape(-1, 3, modes)
        self.u, self.v, self.vd = (rng.standard_normal(modes) for _ in range(3))
        self.omega, self.alpha, self.wd = (rng.standard_normal(3) for _ in range(3))
        self.R = rotation(rng.standard_normal(3))

    def project(self, acceleration):
        """int rho Phi^T R^T a for an acceleration a at the quadrature points, world axes."""
        return np.einsum("p,pij,pi->j", self.rho, self.phi, acceleration @ self.R)


@pytest.fixture(scope="module")
def case(helpers, plastic):
    return Case(helpers, plastic)


def close(a, b):
    return np.abs(np.asarray(a) - b).max() <= RELATIVE * max(np.abs(b).max(), 1e-300)


def M1(inv):
    # int rho Phi^T [X]x: row j is (int rho phi_j x X)^T = -(int rho X x phi_j)^T
    return np.array([-axial(B) for B in inv.M4])


def M2(inv, u):
    return np.einsum("k,jki->ji", u, np.array([[axial(inv.S[j, k]) for k in range(len(u))] for j in range(len(u))]))


def test_deformable_part_equation_4(case):
    direct = case.project(np.einsum("pij,j->pi", case.phi, case.vd) @ case.R.T)
    assert close(case.inv.M @ case.vd, direct)


def test_rigid_part_equation_5(case):
    inv, R = case.inv, case.R
    y = case.X + np.einsum("pij,j->pi", case.phi, case.u)
    direct = case.project(np.cross(case.alpha, y @ R.T) + case.wd)
    assert close(-(M1(inv) + M2(inv, case.u)) @ (R.T @ case.alpha) + inv.M3 @ (R.T @ case.wd), direct)


def test_centrifugal_part_equations_9_and_21(case):
    inv, u, R = case.inv, case.u, case.R
    y = (case.X + np.einsum("pij,j->pi", case.phi, u)) @ R.T
    direct = case.project(np.cross(case.omega, np.cross(case.omega, y)))
    w = R.T @ case.omega
    M5 = np.einsum("k,kjab->jab", u, inv.S)
    M6 = np.trace(inv.M4, axis1=1, axis2=2)
    assert close(np.einsum("a,jab,b->j", w, inv.M4 + M5, w) - (M6 + inv.M @ u) * (w @ w), direct)


def test_coriolis_part_equation_10(case):
    inv, R = case.inv, case.R
    velocity = np.einsum("pij,j->pi", case.phi, case.v) @ R.T
    direct = case.project(2.0 * np.cross(case.omega, velocity))
    assert close(-2.0 * M2(inv, case.v) @ (R.T @ case.omega), direct)


def test_kinetic_energy_from_the_integrals(case):
    inv, u, v, R = case.inv, case.u, case.v, case.R
    y = case.X + np.einsum("pij,j->pi", case.phi, u)
    w_b, omega_b = R.T @ case.wd, R.T @ case.omega
    xdot = w_b + np.cross(omega_b, y) + np.einsum("pij,j->pi", case.phi, v)
    direct = 0.5 * np.einsum("p,pi,pi->", case.rho, xdot, xdot)
    s = inv.s + inv.M3.T @ u
    B = inv.M4 + np.einsum("k,kjab->jab", u, inv.S)
    Z = inv.Z + np.einsum("j,jab->ab", u, inv.M4) + np.einsum("j,jba->ab", u, B)
    J = np.trace(Z) * np.eye(3) - Z
    b = np.array([axial(Bj) for Bj in B])
    M = np.block([[inv.mass * np.eye(3), -skew(s), inv.M3.T], [skew(s), J, b.T], [inv.M3, b, inv.M]])
    V = np.concatenate([w_b, omega_b, v])
    assert 0.5 * V @ M @ V == pytest.approx(direct, rel=RELATIVE)


def test_reduced_integrals_are_the_full_ones_projected(case):
    U = np.random.default_rng(3).standard_normal((case.Phi.shape[2], 3))
    reduced = inertia_integrals(case.nodes, case.model.mass, case.Phi @ U)
    full = case.inv
    assert close(reduced.M, U.T @ full.M @ U)
    assert close(reduced.M3, U.T @ full.M3)
    assert close(reduced.M4, np.einsum("jr,jab->rab", U, full.M4))
    assert close(reduced.S, np.einsum("jr,ks,jkab->rsab", U, U, full.S))


def test_a_box_has_its_exact_mass_center_and_inertia(helpers, plastic):
    (a, b, c), origin = (0.4, 0.1, 0.2), np.array([0.3, -0.2, 0.1])
    points, tets = helpers.box((2, 1, 2), (a, b, c), origin)
    model = assemble(points, tets, plastic)
    inv = inertia_integrals(model.mesh.nodes, model.mass, np.zeros((len(model.mesh.nodes), 3, 0)))
    m = plastic.density * a * b * c
    center = origin + 0.5 * np.array([a, b, c])
    assert inv.mass == pytest.approx(m, rel=1e-14)
    assert np.allclose(inv.s, m * center, rtol=1e-13)
    Z = m * (np.diag([a**2, b**2, c**2]) / 12.0 + np.outer(center, center))
    assert np.allclose(inv.Z, Z, rtol=1e-13, atol=1e-13 * abs(Z).max())
    assert inv.S.shape == (0, 0, 3, 3) and inv.M4.shape == (0, 3, 3)
