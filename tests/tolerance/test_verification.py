"""The measured error of a result: the distance to a finer run, and what that run does not know itself."""

import dataclasses

import pytest
from calmotion.model.run import RunSettings
from calmotion.simulation.body_reduction import reduction_for
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.simulation import simulate_to_tolerance
from calmotion.tolerance.verification import verify


def quiet(fraction, message):
    pass


def test_verifying_measures_the_distance_to_a_finer_run(arm, animation, meshes, bodies):
    options = RunSettings(tolerance=1e-3)
    result = simulate_to_tolerance(compile_shot(arm, animation, bodies), options, quiet)
    shot, reduction = compile_shot(arm, animation, bodies), reduction_for(arm, animation, meshes, options)
    found = verify(shot, reduction, result, options, quiet)
    assert found.step_s == pytest.approx(result.step_s / 4) and found.modes > 6
    assert 0.3 * result.accuracy.step_m < found.error_m < 5e-3
    moved = dataclasses.replace(
        result.before.motion, target_positions=result.before.motion.target_positions + [0.02, 0.0, 0.0]
    )
    wrong = dataclasses.replace(result, before=dataclasses.replace(result.before, motion=moved))
    assert verify(shot, reduction, wrong, options, quiet).error_m == pytest.approx(0.02, abs=1.1 * found.error_m)


def test_the_finer_run_has_finer_elements_also_where_the_user_chose_them(arm, animation, meshes, bodies):
    options, asked = RunSettings(tolerance=1e-2), []
    coarse = [dataclasses.replace(body, mesh_error=0.02 if len(body.stiffness) else None) for body in bodies]
    shot, reduction = compile_shot(arm, animation, coarse), reduction_for(arm, animation, meshes, options)

    def with_finer_meshes(tolerance, wanted, max_nodes, progress, keeps=""):
        asked.append((keeps, set(wanted.values())))
        return reduction

    reduction.with_finer_meshes = with_finer_meshes
    verify(shot, reduction, simulate_to_tolerance(shot, options, quiet), options, quiet)
    assert asked == [("finer", {0.25 * 0.02})]


def test_meshes_that_cannot_be_finer_are_still_counted(arm, animation, bodies):
    """The finer run had the same meshes, and agreed with the result however coarse they were."""
    options = RunSettings(tolerance=1e-2)
    coarse = [dataclasses.replace(body, mesh_error=0.02 if len(body.stiffness) else None) for body in bodies]
    shot = compile_shot(arm, animation, coarse)
    result = simulate_to_tolerance(shot, options, quiet)
    found = verify(shot, None, result, options, quiet)
    assert found.mesh_m == pytest.approx(result.accuracy.mesh_m, rel=0.1) and found.mesh_m > 1e-4
    assert found.bound_m == found.error_m + found.mesh_m
