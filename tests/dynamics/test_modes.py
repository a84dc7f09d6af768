import numpy as np
import pytest
from arms import chain, compiled
from calmotion.dynamics.modes import system_modes
from calmotion.dynamics.simulation import Workspace
from calmotion.dynamics.statics import equilibrium
from particles import particle_system
from test_sweeps import rigid_start


def test_hanging_double_pendulum_has_its_textbook_frequencies():
    found, ratios = system_modes(compiled(chain(2)), np.array([np.pi / 2, 0.0]))
    assert np.abs(ratios).max() < 1e-12, "nothing is damped"
    # equal masses and lengths: omega^2 = (2 -+ sqrt 2) g / L
    expected = np.sqrt((2.0 + np.array([-1.0, 1.0]) * np.sqrt(2.0)) * 9.81) / (2 * np.pi)
    assert np.allclose(found, expected, rtol=1e-6)


def test_driven_rigid_character_has_none():
    assert [len(part) for part in system_modes(compiled(chain(2, driven=(0, 1))), np.zeros(2))] == [0, 0]


def test_equilibrium_is_a_minimum_of_the_potential_seen_by_the_modes():
    """Clamped flexible body without gravity: its own frequencies."""
    system, _ = particle_system(np.random.default_rng(0), [-1], [3])
    from types import SimpleNamespace

    system = system._replace(gravity=np.zeros(3), Phi=0 * system.Phi, Psi=0 * system.Psi)
    state, _ = equilibrium(system, rigid_start(system, np.zeros(1)), np.zeros(1), Workspace.for_system(system))
    assert not state.u.any()
    found, ratios = system_modes(SimpleNamespace(system=system), np.zeros(1))
    assert ratios == pytest.approx(system.damping[0] / (2 * np.sqrt(system.stiffness[0])))
    assert found == pytest.approx(np.sqrt(system.stiffness[0]) / (2 * np.pi))
