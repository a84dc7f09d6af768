"""Meshes get what the tolerance leaves them: the shares of bodies, when they are refined, and what they cost."""

from dataclasses import replace

import pytest
from calmotion.errors import ShotError
from calmotion.model.run import RunSettings
from calmotion.reduction.scaled_stiffness import with_scaled_stiffness
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.meshes import mesh_budget
from calmotion.tolerance.meshes.mesh_budget import locking_error, mesh_error, meshes_to_tolerance, patch_error
from calmotion.tolerance.step_error import distance, simulate_at

OPTIONS, STEP = RunSettings(tolerance=1e-3, integrator="bdf2"), 1 / 240


def with_mesh_errors(bodies, *errors):
    """Flexible bodies with relative errors of stiffness, each with a tenth of a metre of deflection."""
    known = iter(errors)
    flexible = [len(body.stiffness) > 0 for body in bodies]
    values = [next(known) if bends else None for bends in flexible]
    return [
        replace(body, mesh_error=value, mesh_error_m=None if value is None else 0.1 * value)
        for body, value in zip(bodies, values, strict=True)
    ]


class Refining:
    """A reduction that notes which errors are wanted and gives the bodies as they are."""

    def __init__(self, bodies):
        self.given, self.wanted, self.elements, self.released = bodies, None, None, False
        self.nodes = (0, 0)

    def with_finer_meshes(self, tolerance, wanted, max_nodes, progress, elements, poor_nodes):
        self.wanted, self.elements, self.nodes = dict(wanted), dict(elements), (max_nodes, poor_nodes)
        return self

    def bodies(self, tolerance, progress=None):
        return self.given

    def release(self):
        self.released = True


def test_the_cost_is_that_of_bodies_that_are_softer_by_the_error(arm, animation, bodies):
    shot = compile_shot(arm, animation, with_mesh_errors(bodies, 0.02, 0.01))
    run = simulate_at(shot, OPTIONS, STEP)
    softer = [with_scaled_stiffness(body, 1.0 - (body.mesh_error or 0.0)) for body in shot.bodies]
    other = simulate_at(shot.with_bodies(softer), OPTIONS, STEP)
    found = mesh_error(shot, OPTIONS, run)
    assert found == pytest.approx(distance(run.positions, other.positions), rel=1e-9) and found > 1e-5
    half = mesh_error(shot.with_bodies(with_mesh_errors(bodies, 0.01, 0.005)), OPTIONS, run)
    assert half == pytest.approx(0.5 * found, rel=0.1)


def test_what_a_given_mesh_costs_is_not_known(arm, animation, bodies):
    shot = compile_shot(arm, animation, with_mesh_errors(bodies, 0.02, None))
    assert mesh_error(shot, OPTIONS, simulate_at(shot, OPTIONS, STEP)) is None


@pytest.mark.parametrize("errors", [(1e-4, 1e-4), (None, None)])
def test_meshes_that_are_good_enough_or_given_stay_as_they_are(arm, animation, bodies, errors):
    shot, reduction = compile_shot(arm, animation, with_mesh_errors(bodies, *errors)), Refining(bodies)
    assert meshes_to_tolerance(shot, reduction, OPTIONS, None) == (shot, reduction)
    assert reduction.wanted is None and not reduction.released


def test_only_the_mesh_that_costs_most_is_refined(arm, animation, bodies):
    errors = (1e-2, 1e-4)  # a millimetre, and a hundredth of one
    shot = compile_shot(arm, animation, with_mesh_errors(bodies, *errors))
    reduction = Refining(list(shot.bodies))
    meshes_to_tolerance(shot, reduction, OPTIONS, None)
    allowed = mesh_budget.SHARE * OPTIONS.tolerance
    assert reduction.released and set(reduction.wanted) == {0}
    assert 0.5 * allowed < 0.1 * reduction.wanted[0] < allowed
    assert reduction.nodes == (mesh_budget.NODES, mesh_budget.MOST_NODES)


def test_errors_at_the_targets_count_in_place_of_deflections_where_they_are_known(arm, animation, bodies):
    shot = compile_shot(arm, animation, with_mesh_errors(bodies, 1e-2, 1e-2))
    run = simulate_at(shot, OPTIONS, STEP)
    by_deflection, by_motion = Refining(list(shot.bodies)), Refining(list(shot.bodies))
    meshes_to_tolerance(shot, by_deflection, OPTIONS, None)
    meshes_to_tolerance(shot, by_motion, OPTIONS, run)
    total = mesh_error(shot, OPTIONS, run)
    ratio = by_motion.wanted[0] / by_deflection.wanted[0]
    assert ratio == pytest.approx(2e-3 / total, rel=1e-6)  # deflections: two bodies of a millimetre each


def test_finer_elements_are_wanted_where_quadratic_strain_needs_them(arm, animation, bodies, monkeypatch):
    errors = [replace(body, element_error=0.02) for body in with_mesh_errors(bodies, 1e-4, 1e-4)]
    shot = compile_shot(arm, animation, errors)
    run = simulate_at(shot, OPTIONS, STEP)
    assert locking_error(shot, OPTIONS, run) == 0.0, "these bodies are linear"
    allowed = mesh_budget.SHARE * OPTIONS.tolerance
    for locked, wanted in ((0.4 * allowed, None), (2.0 * allowed, 0.2 * 0.02)):
        reduction = Refining(list(shot.bodies))
        monkeypatch.setattr(mesh_budget, "locking_error", lambda *arguments, error=locked: error)
        meshes_to_tolerance(shot, reduction, OPTIONS, run)
        flexible = [b for b, body in enumerate(shot.bodies) if len(body.stiffness)]
        assert reduction.elements == (None if wanted is None else pytest.approx({b: wanted for b in flexible}))


def test_patches_cost_what_softer_bodies_do_whether_the_mesh_is_known_or_not(arm, animation, bodies):
    cut = [replace(body, patch_error=0.0) for body in with_mesh_errors(bodies, 0.02, 0.01)]
    shot = compile_shot(arm, animation, cut)
    run = simulate_at(shot, OPTIONS, STEP)
    assert patch_error(shot, OPTIONS, run) == 0.0
    with_rims = [replace(body, patch_error=0.5 * (body.mesh_error or 0.0)) for body in cut]
    found = patch_error(shot.with_bodies(with_rims), OPTIONS, run)
    meshes = mesh_error(shot.with_bodies(with_rims), OPTIONS, run)
    assert meshes == mesh_error(shot, OPTIONS, run) and found == pytest.approx(0.5 * meshes, rel=0.1)
    given = [replace(body, mesh_error=None, mesh_error_m=None) for body in with_rims]
    assert mesh_error(shot.with_bodies(given), OPTIONS, run) is None
    assert patch_error(shot.with_bodies(given), OPTIONS, run) == found


def test_bodies_that_buckle_with_the_whole_error_tell_it_by_a_part(arm, animation, bodies, monkeypatch):
    shot = compile_shot(arm, animation, [replace(b, patch_error=0.1) for b in with_mesh_errors(bodies, 0.02, 0.01)])
    run, simulated = simulate_at(shot, OPTIONS, STEP), []

    def buckling(least):
        def simulate(other, options, step):
            left = min(
                o.stiffness[0] / b.stiffness[0] for o, b in zip(other.bodies, bodies, strict=True) if len(b.stiffness)
            )
            simulated.append(left)
            if left < least:
                raise ShotError("it buckles")
            return simulate_at(other, options, step)

        return simulate

    monkeypatch.setattr(mesh_budget, "simulate_at", buckling(0.0))
    whole = patch_error(shot, OPTIONS, run)
    monkeypatch.setattr(mesh_budget, "simulate_at", buckling(0.95))
    part = patch_error(shot, OPTIONS, run)
    assert simulated == pytest.approx([0.9, 0.9, 0.975]) and part == pytest.approx(whole, rel=0.2)
    monkeypatch.setattr(mesh_budget, "simulate_at", buckling(2.0))
    assert patch_error(shot, OPTIONS, run) == pytest.approx(2 * 0.1 * 0.1), "by its deflections of a tenth of a metre"
