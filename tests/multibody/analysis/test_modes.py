import dataclasses

import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.modes import Matrices, elastic_modes, falling_rate, system_modes
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import compile_model
from calmotion.multibody.model.topology import span_tree
from calmotion.multibody.statics.equilibrium import equilibrium
from calmotion.simulation.bodies import reduce_bodies
from calmotion.testing import beam_arm
from four_bar import four_bar
from particles import particle_system
from sweep_cases import rigid_start


def test_hanging_double_pendulum_has_its_textbook_frequencies():
    found, ratios = system_modes(compiled(chain(2)), np.array([np.pi / 2, 0.0]))
    assert np.abs(ratios).max() < 1e-12, "nothing is damped"
    # equal masses and lengths: omega^2 = (2 -+ sqrt 2) g / L
    expected = np.sqrt((2.0 + np.array([-1.0, 1.0]) * np.sqrt(2.0)) * 9.81) / (2 * np.pi)
    assert np.allclose(found, expected, rtol=1e-6)


def test_driven_rigid_character_has_none():
    assert [len(part) for part in system_modes(compiled(chain(2, driven=(0, 1))), np.zeros(2))] == [0, 0]


def test_equilibrium_is_a_minimum_of_the_potential_in_the_modes():
    """Clamped flexible body without gravity: its own frequencies."""
    system, _ = particle_system(np.random.default_rng(0), [-1], [3])
    from types import SimpleNamespace

    system = system._replace(gravity=np.zeros(3), Phi=0 * system.Phi, Psi=0 * system.Psi)
    state, _ = equilibrium(system, rigid_start(system, np.zeros(1)), np.zeros(1), Workspace.for_system(system))
    assert not state.u.any()
    found, ratios = system_modes(SimpleNamespace(system=system, turned=lambda angles: angles), np.zeros(1))
    assert ratios == pytest.approx(np.diag(system.damping[0]) / (2 * np.sqrt(system.stiffness[0])))
    assert found == pytest.approx(np.sqrt(system.stiffness[0]) / (2 * np.pi))


def reduced(made):
    character, meshes = made
    tree = span_tree(character)
    return compile_model(character, tree, reduce_bodies(character, tree, meshes))


def test_elastic_modes_are_those_of_the_undeformed_character():
    model = reduced(beam_arm(links=2, gravity=0.0, elasticity="linear", modes=8))
    omega, shapes = elastic_modes(model)
    found, _ = system_modes(model, np.zeros(len(model.motor)))
    assert omega / (2 * np.pi) == pytest.approx(found, rel=1e-9)
    assert [shape.shape for shape in shapes] == [(8, 16), (8, 16), (0, 16)]
    energy = sum(
        (shape**2 * model.system.stiffness[b, : len(shape), None]).sum(axis=0) for b, shape in enumerate(shapes)
    )
    assert energy == pytest.approx(omega**2, rel=1e-9), "all energy is elastic, and the modes have mass one"


@pytest.mark.parametrize(
    "made",
    [beam_arm(payload=0.5, damping=0.03, gravity=0.0, elasticity="linear", modes=8), four_bar(modes=7, damping=0.03)],
    ids=["a link with a load", "a coupler in a loop"],
)
def test_a_character_with_one_flexible_body_vibrates_with_the_ratio_of_its_material(made):
    model = reduced(made)
    _, ratios = system_modes(model, model.rest_angles)
    assert len(ratios) and ratios == pytest.approx(np.full(len(ratios), 0.03), rel=0.01)


def test_slow_modes_are_exact_beside_stretches_that_are_far_stiffer():
    """A strip of 1 mm: bending at 2 Hz, and coordinates of 10^8 Hz that are coupled by the mass."""
    stiffness = np.diag(np.logspace(4, 19, 12))
    couplings = np.random.default_rng(0).normal(size=(12, 12))
    mass = np.eye(12) + 0.05 * couplings @ couplings.T
    rest = (mass, np.zeros_like(mass), np.eye(12), np.zeros((0, 12)))
    (squares, shapes), factor = Matrices(stiffness, *rest).modes(), 1.0 + 1e-6
    stiffer = Matrices(factor * stiffness, *rest).modes()[0]
    assert stiffer / squares == pytest.approx(np.full(12, factor), rel=1e-11)
    assert shapes.T @ mass @ shapes == pytest.approx(np.eye(12), abs=1e-9)
    # the force on each coordinate, from which damping is made, to rounding
    forces, inertia = stiffness @ shapes[:, 0], squares[0] * mass @ shapes[:, 0]
    assert forces == pytest.approx(inertia, rel=1e-9)


@pytest.mark.parametrize("law", ["linear", "stvk"])
def test_slow_modes_of_a_chain_have_about_the_ratio(law):
    model = reduced(beam_arm(links=2, damping=0.03, gravity=0.0, elasticity=law, modes=8))
    _, ratios = system_modes(model, model.rest_angles)
    assert np.all((0.015 < ratios[:4]) & (ratios[:4] < 0.06))


def test_what_hangs_free_has_no_elastic_frequency():
    character, meshes = beam_arm(links=5, gravity=0.0, elasticity="linear", modes=8)
    omega, shapes = elastic_modes(reduced((dataclasses.replace(character, motors=()), meshes)))
    slow = omega < 1e-12 * omega[-1]
    assert np.flatnonzero(slow).tolist() == [0, 1, 2, 3, 4], "the hinges turn without a force, to rounding"
    assert max(np.abs(shape[:, slow]).max(initial=0.0) for shape in shapes) < 1e-9


def test_an_upright_pendulum_falls_and_a_hanging_one_does_not():
    """exp(t sqrt(g / L)) of a mass on a rod of 0.4 m."""
    model = compiled(chain(1, length=0.4))
    world = Workspace.for_system(model.system).work.world
    for angle, rate in ((-np.pi / 2, np.sqrt(9.81 / 0.4)), (np.pi / 2, 0.0)):
        angles = np.array([angle])
        assert falling_rate(model, rigid_state(model, angles), angles, world) == pytest.approx(rate, rel=1e-6)
