"""The basis that a known load_envelope needs, against static solutions of the unreduced body."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.model import FlexibleSettings
from calmotion.reduction.basis.craig_bampton import reduced_basis, rigid_patch
from calmotion.reduction.basis.fixed_interface import FixedInterface, ritz_modes
from calmotion.reduction.basis.natural_modes import SparseSolver, clamped_modes, vector_mass
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.elements.embedding import embed
from calmotion.reduction.load_envelope import LoadEnvelope
from scipy.linalg import eigh
from scipy.sparse import bmat, csr_matrix, identity

TIP = np.array([0.6, 0.0, 0.0])
REACH = 0.4
TARGETS = np.array([[0.31, 0.002, 0.001], [0.6, 0.01, 0.015]])


def an_excitation(scale=1.0, frequency=0.0):
    return LoadEnvelope(
        acceleration=scale * np.array([4.0, 6.0, 15.0]),
        angular_acceleration=scale * np.array([20.0, 40.0, 30.0]),
        angular_velocity=np.sqrt(scale) * np.array([1.0, 3.0, 2.0]),
        force=scale * np.array([[5.0, 8.0, 12.0]]),
        moment=scale * np.array([[0.1, 0.3, 0.2]]),
        target_distance=np.array([REACH]),
        frequency=frequency,
    )


class Body:
    """A bar with a clamped and a moving end, and its static solutions: nodes of the patch on its six coordinates."""

    def __init__(self, model, settings):
        self.model, self.settings = model, settings
        x = model.mesh.nodes[:, 0]
        self.root, self.tip = np.flatnonzero(x < 1e-9), np.flatnonzero(x > 0.6 - 1e-9)
        n = len(x)
        inner = np.setdiff1d(np.arange(n), np.concatenate([self.root, self.tip]))
        patch = np.zeros((n, 3, 6))
        patch[self.tip] = rigid_patch(model.mesh.nodes[self.tip], TIP)
        self.select = identity(3 * n, format="csr")[:, (3 * inner[:, None] + np.arange(3)).ravel()]
        self.T = bmat([[self.select, csr_matrix(patch.reshape(3 * n, 6))]], format="csr")
        self.solver = SparseSolver((self.T.T @ model.stiffness @ self.T).tocsr())
        self.embedding = embed(model.mesh, TARGETS)

    def basis(self, settings=None, **options):
        options = {"targets": self.embedding.displacements} | options
        return reduced_basis(self.model, self.root, [self.tip], [TIP], settings or self.settings, **options)

    def force(self, accelerations, wrench):
        """Generalised forces of accelerations (linear, angular, and angular velocity) and a wrench on the tip."""
        nodes, (a, alpha, omega) = self.model.mesh.nodes, accelerations
        field = a + np.cross(alpha, nodes) + np.cross(omega, np.cross(omega, nodes))
        force = self.T.T @ -(vector_mass(self.model.mass) @ field.ravel())
        force[-6:] += wrench
        return force

    def full(self, force):
        """Nodal displacements [n, 3] and motion of the tip [6]."""
        x = self.solver.solve(force)
        return (self.T @ x).reshape(-1, 3), x[-6:]

    def reduced(self, basis, force):
        modes = basis.modes.reshape(-1, len(basis.omega_squared))
        generalized = modes.T @ (self.select @ force[:-6]) + basis.patch_motion[0].T @ force[-6:]
        q = generalized / basis.omega_squared
        return (modes @ q).reshape(-1, 3), basis.patch_motion[0] @ q

    def error(self, basis, force):
        """Largest static error of a basis at the outputs [m]."""
        (u, motion), (v, moved) = self.full(force), self.reduced(basis, force)
        places = self.embedding.displacements((u - v)[:, :, None])[:, :, 0]
        outputs = np.vstack([places, (motion - moved)[:3], REACH * (motion - moved)[3:]])
        return float(np.linalg.norm(outputs, axis=1).max())


@pytest.fixture(scope="module")
def body(helpers, plastic):
    model = assemble(*helpers.box((16, 1, 2), (0.6, 0.02, 0.03), origin=(0, -0.01, -0.015)), plastic)
    return Body(model, FlexibleSettings(plastic))


def peaks_of(load_envelope, rng):
    """A load within the peaks: all of them at once, with random signs."""

    def sign(peak):
        return rng.choice([-1.0, 1.0], size=3) * peak

    accelerations = (
        sign(load_envelope.acceleration),
        sign(load_envelope.angular_acceleration),
        sign(load_envelope.angular_velocity),
    )
    return accelerations, np.concatenate([sign(load_envelope.force[0]), sign(load_envelope.moment[0])])


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-6])
def test_the_error_of_omitted_modes_is_below_the_estimate_but_not_far_below(body, tolerance):
    load_envelope = an_excitation()
    basis = body.basis(load_envelope=load_envelope, tolerance=tolerance)
    rng = np.random.default_rng(3)
    errors = [body.error(basis, body.force(*peaks_of(load_envelope, rng))) for _ in range(200)]
    assert max(errors) <= basis.cut_error_m * (1 + 1e-6) + 1e-12
    assert max(errors) >= 0.3 * basis.cut_error_m - 1e-12
    assert basis.cut_error_m <= tolerance


def test_the_error_of_one_load_alone_is_predicted_exactly(body):
    nothing = LoadEnvelope(*(np.zeros(3),) * 3, np.zeros((1, 3)), np.zeros((1, 3)), target_distance=np.array([REACH]))
    settings = replace(body.settings, mode_count=3)
    loads = {
        "acceleration": np.array([0.0, 0.0, 9.81]),
        "angular_acceleration": np.array([0.0, 30.0, 0.0]),
        "angular_velocity": np.array([0.0, 4.0, 0.0]),
        "force": np.array([[0.0, 7.0, 0.0]]),
        "moment": np.array([[0.3, 0.0, 0.0]]),
    }
    for name, value in loads.items():
        load_envelope = replace(nothing, **{name: value})
        basis = body.basis(settings, load_envelope=load_envelope)
        accelerations = load_envelope.acceleration, load_envelope.angular_acceleration, load_envelope.angular_velocity
        force = body.force(accelerations, np.concatenate([load_envelope.force[0], load_envelope.moment[0]]))
        assert len(basis.omega_squared) == 3
        assert body.error(basis, force) == pytest.approx(basis.cut_error_m, rel=1e-5, abs=1e-12), name


def test_a_gentler_shot_needs_fewer_modes(body):
    gentle, rough = (body.basis(load_envelope=an_excitation(scale), tolerance=1e-3) for scale in (0.1, 10.0))
    assert len(gentle.omega_squared) < len(rough.omega_squared)


def test_modes_in_the_excited_band_are_kept_whatever_their_deflection(body):
    full = clamped_modes(body.model, 8, body.root)[0]
    load_envelope = an_excitation(1e-6, frequency=0.5 * float(full[4] + full[5]) / 2.0)
    basis = body.basis(load_envelope=load_envelope, tolerance=1e-3)
    f = np.sqrt(basis.omega_squared) / (2 * np.pi)
    assert len(f) == 5 and basis.residual == 0
    assert np.allclose(f, full[:5], rtol=1e-4)


def test_a_highest_frequency_is_met_by_residual_vectors_instead_of_modes(body):
    full = clamped_modes(body.model, 8, body.root)[0]
    settings = replace(body.settings, max_frequency=float(0.5 * (full[3] + full[4])))
    basis = body.basis(settings, load_envelope=an_excitation(1e-3), tolerance=1e-7)
    f = np.sqrt(basis.omega_squared) / (2 * np.pi)
    assert np.allclose(f[:4], full[:4], rtol=1e-4) and basis.residual > 0 and len(f) == 4 + basis.residual
    assert basis.cut_error_m <= 1e-7


@pytest.mark.parametrize("slender, accuracy", [(False, 1e-9), (True, 1e-8)])
def test_with_all_residual_vectors_static_deflection_is_that_of_the_full_model(
    helpers, plastic, body, slender, accuracy
):
    """Rounding grows with the slenderness, of the full solution as of the basis."""
    if not slender:
        model = assemble(*helpers.box((8, 2, 2), (0.6, 0.1, 0.12), origin=(0, -0.05, -0.06)), plastic)
        body = Body(model, body.settings)
    load_envelope = an_excitation()
    basis = body.basis(load_envelope=load_envelope, tolerance=0.0)
    rng = np.random.default_rng(5)
    for _ in range(3):
        force = body.force(*peaks_of(load_envelope, rng))
        (u, motion), (v, moved) = body.full(force), body.reduced(basis, force)
        assert np.abs(u - v).max() < accuracy * np.abs(u).max()
        for part in (slice(0, 3), slice(3, 6)):
            assert np.allclose(motion[part], moved[part], rtol=0.0, atol=accuracy * np.abs(motion[part]).max())


def test_residual_vectors_contain_all_but_a_thousandth_of_the_work_and_lower_frequency_errors(body):
    """Nobody says what excites the body: fixed-interface modes below a limit under which there are none."""
    settings = replace(body.settings, max_frequency=1.0)
    corrected = body.basis(settings)
    assert corrected.residual > 0 and corrected.cut_error_m is None
    full = clamped_modes(body.model, 4, body.root)[0]

    def frequency_errors(basis):
        return np.sqrt(basis.omega_squared[:4]) / (2 * np.pi) / full - 1.0

    fixed = FixedInterface.of(body.model, body.root, [body.tip], [TIP])
    alone = np.sqrt(ritz_modes(body.model, fixed.constraint)[0][:4]) / (2 * np.pi) / full - 1.0
    assert (frequency_errors(corrected) > -1e-9).all()
    assert (frequency_errors(corrected) < 0.5 * alone).all()
    weight = body.force((np.array([0.0, 0.0, 9.81]), np.zeros(3), np.zeros(3)), np.zeros(6))
    (u, _), (v, _) = body.full(weight), body.reduced(corrected, weight)
    assert np.abs(u - v).max() < 2e-3 * np.abs(u).max()


def test_the_deflection_of_a_body_without_children_is_that_of_its_surface(body):
    none = np.zeros((0, 3))
    load_envelope = LoadEnvelope(np.array([0.0, 0.0, 9.81]), np.zeros(3), np.zeros(3), none, none)
    basis = reduced_basis(
        body.model, body.root, [], [], body.settings, load_envelope=load_envelope, tolerance=1e-5, targets=None
    )
    n = len(body.model.mesh.nodes)
    dofs = np.setdiff1d(np.arange(3 * n), (3 * body.root[:, None] + np.arange(3)).ravel())
    load = (vector_mass(body.model.mass) @ np.tile([0.0, 0.0, -9.81], n))[dofs]
    u = np.zeros(3 * n)
    u[dofs] = SparseSolver(body.model.stiffness[dofs][:, dofs]).solve(load)
    U = basis.modes.reshape(3 * n, -1)
    v = U @ ((U[dofs].T @ load) / basis.omega_squared)
    missing = np.linalg.norm((u - v).reshape(n, 3), axis=1).max()
    # a bent body meets its loads from other directions as well
    assert missing <= basis.cut_error_m <= 1.1 * missing and missing <= 1e-5
    assert 0 < len(basis.omega_squared) < 6


def test_modes_far_above_a_known_excitation_are_replaced_by_fewer_vectors(body):
    """Nothing slower is said of the first: all of its modes may ring."""
    unknown = body.basis(load_envelope=an_excitation(), tolerance=1e-5)
    slow = body.basis(load_envelope=an_excitation(frequency=2.0), tolerance=1e-5)
    assert len(slow.omega_squared) < len(unknown.omega_squared) and slow.residual > unknown.residual
    assert slow.cut_error_m <= 1e-5
    # the first two bending modes still ring: a load at 2 Hz makes them deflect a tenth further than at rest
    f = np.sqrt(slow.omega_squared[:2]) / (2 * np.pi)
    assert np.allclose(f, clamped_modes(body.model, 2, body.root)[0], rtol=1e-4)


def test_a_load_that_turns_swings_as_fast_whatever_the_tolerance(body):
    """What a force alone moves is within the tolerance with one coordinate, and the frequency would be too high."""
    mass, inertia, none = 1.5, 0.25, np.zeros(3)
    loads = LoadEnvelope(none, none, none, np.array([[0.0, 0.0, 12.0]]), np.array([[0.0, 3.0, 0.0]]))
    moved = body.full(np.concatenate([np.zeros(body.T.shape[1] - 6), [0, 0, 12.0, 0, 0, 0]]))[1]

    def lowest(basis):
        motion = basis.patch_motion[0]
        M = np.eye(motion.shape[1]) + mass * np.outer(motion[2], motion[2]) + inertia * np.outer(motion[4], motion[4])
        return float(np.sqrt(eigh(np.diag(basis.omega_squared), M, eigvals_only=True)[0]))

    few = body.basis(load_envelope=loads, tolerance=0.3 * float(np.linalg.norm(moved[:3])))
    assert lowest(few) == pytest.approx(lowest(body.basis(replace(body.settings, mode_count=12))), rel=0.02)
