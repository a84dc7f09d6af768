"""Damping from a ratio: modes have it, those of a body by itself and those of a body that carries something."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.model import ElasticMaterial
from calmotion.reduction.damping import EXACT_MODES, damped, modal_damping
from calmotion.reduction.reduced_body import Elasticity, Invariants, ReducedBody
from scipy.linalg import eigh

MATERIAL = ElasticMaterial("/M", 1e9, 0.3, 1e3, damping_ratio=0.02)
OMEGA = np.array([40.0, 41.0, 90.0, 250.0, 300.0, 420.0, 700.0, 900.0])
R = len(OMEGA)


def loaded_mass():
    """Three kilograms and their turns, on modes of mass one."""
    motion = np.random.default_rng(0).normal(size=(6, R))
    return np.eye(R) + motion.T @ np.diag([3.0, 3.0, 3.0, 0.01, 0.02, 0.01]) @ motion


def loaded_modes():
    values, shapes = eigh(np.diag(OMEGA**2), loaded_mass())
    return np.sqrt(values), shapes


def ratios_of(mass, damping):
    """Frequencies and ratios of all modes, from the eigenvalues of the first-order system."""
    inverse = np.linalg.inv(mass)
    system = np.block([[np.zeros((R, R)), np.eye(R)], [-inverse @ np.diag(OMEGA**2), -inverse @ damping]])
    values = np.linalg.eigvals(system)
    values = values[values.imag > 0.0]
    values = values[np.argsort(np.abs(values))]
    return np.abs(values), -values.real / np.abs(values)


def body(law=None):
    empty = Invariants(1.0, np.zeros(3), np.eye(3), np.eye(R), np.zeros((R, 3)), np.zeros((R, 3, 3)), np.zeros(0))
    elasticity = None if law is None else Elasticity(law, 0.0, np.zeros(0))
    return ReducedBody(empty, OMEGA**2, np.zeros((R, R)), (), elasticity=elasticity)


def test_a_body_by_itself_is_damped_mode_by_mode():
    assert np.allclose(modal_damping(np.array([4.0, 9.0]), MATERIAL), 2 * 0.02 * np.array([2.0, 3.0]))
    assert np.allclose(damped(body(), MATERIAL).damping, np.diag(2 * 0.02 * OMEGA))
    assert np.allclose(ratios_of(np.eye(R), damped(body(), MATERIAL).damping)[1], 0.02)


def test_every_mode_of_a_loaded_body_has_the_ratio():
    found = damped(body(), MATERIAL, *loaded_modes())
    omega, ratio = ratios_of(loaded_mass(), found.damping)
    assert omega[0] < 0.5 * OMEGA[0], "the load slows it down"
    assert ratio == pytest.approx(np.full(R, 0.02), rel=1e-9)
    _, alone = ratios_of(loaded_mass(), damped(body(), MATERIAL).damping)
    assert alone[0] < 0.5 * ratio[0], "one that is damped as if it carried nothing rings on"


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_a_nonlinear_body_has_the_ratio_up_to_its_last_paired_mode_and_more_above(law):
    omega, shapes = loaded_modes()
    found = damped(body(law), MATERIAL, omega, shapes)
    retardation = found.elasticity.retardation
    _, ratio = ratios_of(loaded_mass(), found.damping + retardation * np.diag(OMEGA**2))
    assert ratio[:EXACT_MODES] == pytest.approx(np.full(EXACT_MODES, 0.02), rel=1e-6)
    assert ratio[EXACT_MODES:] == pytest.approx(0.5 * retardation * omega[EXACT_MODES:], rel=1e-3)
    assert np.linalg.matrix_rank(found.damping, tol=1e-9) == EXACT_MODES - 1, "above them no coordinate is resisted"


def test_modes_of_other_bodies_and_rigid_motions_have_no_effect():
    omega, shapes = loaded_modes()
    expected = damped(body("stvk"), MATERIAL, omega, shapes)
    more = np.concatenate([[0.0, 5.0, 6.0, 7.0], omega])
    found = damped(body("stvk"), MATERIAL, more, np.concatenate([np.zeros((R, 4)), shapes], axis=1))
    assert np.allclose(found.damping, expected.damping, rtol=1e-12)
    assert found.elasticity.retardation == expected.elasticity.retardation


@pytest.mark.parametrize("law", [None, "stvk"])
def test_rayleigh_coefficients_are_taken_as_authored(law):
    material = replace(MATERIAL, rayleigh=(0.3, 1e-4))
    one, other = damped(body(law), material), damped(body(law), material, *loaded_modes())
    assert np.array_equal(one.damping, other.damping)
    assert np.allclose(one.damping, np.diag(0.3 + (0.0 if law else 1e-4) * OMEGA**2))
    assert law is None or one.elasticity.retardation == 1e-4
