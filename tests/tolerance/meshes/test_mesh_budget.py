"""Meshes get what the tolerance leaves them: the shares of bodies, when they are refined, and what they cost."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import FEMesh, FEMeshes
from calmotion.model.meshes import MeshQuality
from calmotion.model.run import RunSettings
from calmotion.reduction.scaled_stiffness import with_scaled_stiffness
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.meshes import mesh_budget
from calmotion.tolerance.meshes.mesh_budget import mesh_error, meshes_to_tolerance, uncertainty_error
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

    def __init__(self, bodies, volume_errors=()):
        self.given, self.wanted, self.released, self.most = bodies, None, False, None
        qualities = [MeshQuality(20.0, 1e-4, error) for error in volume_errors or len(bodies) * [0.0]]
        nothing = np.zeros((0, 3)), np.zeros((0, 4), np.int32)
        self.meshes = FEMeshes(tuple(FEMesh(b, *nothing, quality) for b, quality in enumerate(qualities)))

    def with_finer_meshes(self, tolerance, wanted, max_nodes, progress):
        self.wanted, self.most = dict(wanted), max_nodes
        return self

    def bodies(self, tolerance, progress=None):
        return self.given

    def release(self):
        self.released = True


def by_deflections(shot, reduction, options):
    """`meshes_to_tolerance` where deflections cost less than the motion."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mesh_budget, "mesh_error", lambda shot, options, run: float("inf"))
        meshes_to_tolerance(shot, reduction, options, None, retargeted=True)


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
    run = simulate_at(shot, OPTIONS, STEP)
    assert meshes_to_tolerance(shot, reduction, OPTIONS, run, retargeted=True) == (shot, reduction)
    assert reduction.wanted is None and not reduction.released


def test_only_the_mesh_that_costs_most_is_refined(arm, animation, bodies):
    errors = (1e-2, 1e-4)  # a millimetre, and a hundredth of one
    shot = compile_shot(arm, animation, with_mesh_errors(bodies, *errors))
    reduction = Refining(list(shot.bodies))
    by_deflections(shot, reduction, OPTIONS)
    allowed = mesh_budget.SHARE * OPTIONS.tolerance
    assert reduction.released and set(reduction.wanted) == {0}
    assert 0.5 * allowed < 0.1 * reduction.wanted[0] < allowed


@pytest.mark.parametrize("retargeted", [False, True])
@pytest.mark.parametrize("deflected", [0.4, 10.0])
def test_errors_at_the_targets_count_and_of_a_shake_that_will_be_removed_no_more_than_deflections(
    arm, animation, bodies, retargeted, deflected
):
    shot = compile_shot(arm, animation, with_mesh_errors(bodies, 5e-2, 5e-2))
    run = simulate_at(shot, OPTIONS, STEP)
    total = mesh_error(shot, OPTIONS, run)
    shot = shot.with_bodies([
        replace(body, mesh_error_m=None if body.mesh_error is None else 0.5 * deflected * total) for body in shot.bodies
    ])  # fmt: skip
    reduction = Refining(list(shot.bodies))
    meshes_to_tolerance(shot, reduction, OPTIONS, run, retargeted=retargeted)
    counted = min(deflected, 1.0) * total if retargeted else total
    assert reduction.wanted[0] == pytest.approx(5e-2 * 0.8 * mesh_budget.SHARE * OPTIONS.tolerance / counted, rel=1e-6)


@pytest.mark.parametrize("tolerance, wanted", [(1e-5, 1.25e-5), (None, 2e-2)])
def test_meshes_are_no_finer_than_the_modulus_is_known_unless_a_tolerance_is_asked_for(
    arm, animation, bodies, tolerance, wanted
):
    known = replace(arm, retarget=replace(arm.retarget, tolerance=None))
    shot = compile_shot(known, animation, with_mesh_errors(bodies, 0.2, 1e-4))
    reduction = Refining(list(shot.bodies))
    by_deflections(shot, reduction, RunSettings(tolerance=tolerance))
    allowed = mesh_budget.SHARE * 1e-5 / 0.1
    assert reduction.wanted[0] == pytest.approx(0.02) if tolerance is None else reduction.wanted[0] < allowed
    assert (1 in reduction.wanted) == (tolerance is not None and 1e-4 > 0.5 * allowed)


@pytest.mark.parametrize("of_volume, refined", [(0.0, True), (0.02, True), (0.09, False)])
def test_a_mesh_is_not_refined_for_its_volume_which_finer_elements_keep(arm, animation, bodies, of_volume, refined):
    known = replace(arm, retarget=replace(arm.retarget, tolerance=None))
    shot = compile_shot(known, animation, with_mesh_errors(bodies, 0.2, 1e-4))
    reduction = Refining(list(shot.bodies), [of_volume, *(len(bodies) - 1) * [0.0]])
    by_deflections(shot, reduction, RunSettings())
    assert (reduction.wanted is not None) == refined
    assert not refined or reduction.wanted[0] == pytest.approx(0.02)


@pytest.mark.parametrize("tolerance", [None, 1e-5])
@pytest.mark.parametrize("nodes", [20_000, 30_000, 80_000])
def test_meshes_have_few_nodes_and_more_where_a_tolerance_is_asked_for(arm, animation, bodies, tolerance, nodes):
    known = replace(arm, retarget=replace(arm.retarget, tolerance=None))
    many = [replace(body, nodes=nodes) for body in with_mesh_errors(bodies, 0.2, 0.2)]
    reduction = Refining(many)
    by_deflections(compile_shot(known, animation, many), reduction, RunSettings(tolerance=tolerance))
    most = 30_000 if tolerance is None else 100_000
    assert reduction.most == (most if 1.4 * nodes <= most else None)


def test_what_an_uncertain_modulus_does_counts_only_where_no_tolerance_is_asked_for(arm, animation, bodies):
    known = replace(arm, retarget=replace(arm.retarget, tolerance=None))
    shot = compile_shot(known, animation, with_mesh_errors(bodies, 1.0 - 1.0 / 1.1, 1.0 - 1.0 / 1.1))
    run = simulate_at(shot, OPTIONS, STEP)
    assert uncertainty_error(shot, OPTIONS, run) == 0.0
    found = uncertainty_error(shot, RunSettings(integrator="bdf2"), run)
    assert found == pytest.approx(mesh_error(shot, OPTIONS, run), rel=1e-6), "of bodies that are as much softer"


def test_bodies_that_buckle_with_the_whole_error_tell_it_by_a_part(arm, animation, bodies, monkeypatch):
    shot = compile_shot(arm, animation, with_mesh_errors(bodies, 0.1, 0.1))
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
    whole = mesh_error(shot, OPTIONS, run)
    monkeypatch.setattr(mesh_budget, "simulate_at", buckling(0.95))
    part = mesh_error(shot, OPTIONS, run)
    assert simulated == pytest.approx([0.9, 0.9, 0.975]) and part == pytest.approx(whole, rel=0.2)
    monkeypatch.setattr(mesh_budget, "simulate_at", buckling(2.0))
    assert mesh_error(shot, OPTIONS, run) == pytest.approx(2 * 0.1 * 0.1), "by its deflections of a tenth of a metre"
