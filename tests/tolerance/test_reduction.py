"""A reduction that is fine enough for the simulation: against one far finer, and no finer than it must be."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from calmotion.model import FEMeshes
from calmotion.model.character import with_settings
from calmotion.model.run import RunSettings
from calmotion.simulation import body_reduction
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.body_reduction import BodyReduction, reduction_for
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion.tolerance import reduction as module
from calmotion.tolerance.integrator_choice import FAST
from calmotion.tolerance.pod_subspace import ReferenceRun
from calmotion.tolerance.reduction import converged_reduction
from calmotion.tolerance.step_error import distance, simulate_at
from made_shots import reduced_shot

STEP = 1 / 480
BY = RunSettings(integrator=FAST)


def refined(arm, animation, meshes, tolerance, **kwargs):
    options = RunSettings(tolerance=tolerance, step=STEP)
    reduction = reduction_for(arm, animation, meshes, options, repeats=True)
    first = compile_shot(arm, animation, reduction.bodies(tolerance))
    return converged_reduction(first, reduction, options, **kwargs)


def count(shot):
    return sum(len(body.stiffness) for body in shot.bodies)


@pytest.fixture(scope="module")
def fine(arm, animation, meshes):
    shot = reduced_shot(arm, animation, meshes, RunSettings(tolerance=1e-6))
    return shot, simulate_at(shot, BY, STEP).positions


@pytest.fixture(scope="module")
def converged_for(arm, animation, meshes):
    """What a tolerance needs, found once."""
    return cache(lambda tolerance: refined(arm, animation, meshes, tolerance))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, pytest.param(1e-4, marks=pytest.mark.long)])
def test_the_motion_keeps_the_tolerance_against_a_far_finer_reduction(converged_for, fine, tolerance):
    converged = converged_for(tolerance)
    found = simulate_at(converged.shot, BY, STEP).positions
    assert np.linalg.norm(found - fine[1], axis=2).max() < tolerance and converged.error_m <= 0.4 * tolerance
    np.testing.assert_allclose(converged.known.run.positions, found, rtol=0.0, atol=1e-10)  # but for rounding
    if tolerance > 5e-4:
        assert count(converged.shot) < count(fine[0])


def swung(turned):
    """An arm of two flat links that swings in a plane, turned about their axes by an angle to it [rad]."""
    character, meshes = beam_arm(2, length=0.3, thickness=0.016, payload=0.2, across=1)
    cosine, sine = np.cos(turned), np.sin(turned)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
    flat = FEMeshes(
        tuple(dataclasses.replace(mesh, points=mesh.points * [1.0, 2.0, 1.0] @ turn.T) for mesh in meshes.meshes)
    )
    move, back = quintic(0.8, 0.4, 0.2), quintic(-1.1, 0.35, 0.9)
    return character, shot_of(lambda t: move(t) + back(t), 1.5, motors=2), flat


@pytest.mark.parametrize("turned", [0.0, 0.5])
def test_directions_are_those_of_loads_on_the_flexible_robot(turned, monkeypatch):
    """In the plane a flat link bends aside of no load; turned, it does, which a rigid robot's loads do not tell."""
    shot = swung(turned)
    finest = reduced_shot(*shot, RunSettings(tolerance=1e-6))
    converged = refined(*shot, 1e-3)
    positions = [simulate_at(item, BY, STEP).positions for item in (converged.shot, finest)]
    assert distance(*positions) < 1e-3
    assert (np.abs(positions[1][:, :, 1]).max() > 1e-3) == (turned > 0.0)
    monkeypatch.setattr(BodyReduction, "with_directions", lambda self, loads: self)
    assert count(converged.shot) <= (0.7 if turned == 0.0 else 1.0) * count(refined(*shot, 1e-3).shot)


def test_a_tighter_tolerance_keeps_more(converged_for):
    loose, tight = (count(converged_for(tolerance).shot) for tolerance in (1e-2, 1e-3))
    assert loose < tight


def test_a_shake_that_will_be_removed_needs_less_accuracy(arm, animation, meshes, converged_for):
    loose = count(refined(arm, animation, meshes, 3e-4, retargeted=True).shot)
    assert count(converged_for(1e-2).shot) <= loose < count(converged_for(3e-4).shot)


def test_a_reduction_is_not_refined_far_below_the_error_of_the_meshes(arm, animation, meshes, monkeypatch):
    monkeypatch.setattr(module, "SHARE", 1e-9)  # never reached
    monkeypatch.setattr(module, "MOST", 3)
    finest = refined(arm, animation, meshes, 1e-2)
    monkeypatch.setattr(module, "mesh_error", lambda shot, options, run: 1.0)
    stopped = refined(arm, animation, meshes, 1e-2)
    assert count(stopped.shot) < count(finest.shot) and stopped.error_m > 1e-9


def test_fine_reductions_see_pairs_as_for_a_tenth_of_the_tolerance(arm, animation, meshes, monkeypatch):
    levels = []

    def spied(character, *arguments):
        levels.append((arguments[4], [b.flexible.pairs_share for b in character.bodies if b.flexible is not None]))
        return reduce_bodies(character, *arguments)

    monkeypatch.setattr(body_reduction, "reduce_bodies", spied)
    monkeypatch.setattr(module, "SHARE", 1e-3)  # goes on to finer ones
    monkeypatch.setattr(module, "MOST", 3)
    refined(arm, animation, meshes, 1e-2)
    assert [level for level, _ in levels] == pytest.approx([1e-2, 1e-3, 1e-4, 1e-5])
    for (level, shares), seen in zip(levels, (1e-2, 1e-3, 1e-3, 1e-3), strict=True):
        np.testing.assert_allclose([level * share for share in shares], seen)


def test_reductions_are_compared_by_one_integrator(arm, animation, meshes, monkeypatch):
    reference_run, runs = module.reference_run, []

    def gives_way_for_the_second(shot, options, step, **wanted):
        if len(runs) == 1:
            options = dataclasses.replace(options, integrator="bdf2")
        runs.append(reference_run(shot, options, step, **wanted).run)
        return ReferenceRun(animation, runs[-1])

    monkeypatch.setattr(module, "reference_run", gives_way_for_the_second)
    # in threads, any of two runs may be the second to end
    monkeypatch.setattr(module, "in_parallel", lambda work, items: [work(item) for item in items])
    monkeypatch.setattr(module, "SHARE", 1.0)  # the second will do
    converged = refined(arm, animation, meshes, 1e-2)
    assert [run.integrator for run in runs] == [FAST, "bdf2", "bdf2", "bdf2"] and converged.known.run is runs[3]
    assert converged.error_m == distance(runs[3].positions, runs[2].positions)


def test_what_authored_modes_leave_out_is_a_part_of_the_error(arm, animation, meshes, fine):
    """No finer tolerance brings them back: the error was estimated as none, and the tolerance told to be kept."""
    limited = with_settings(arm, lambda own: dataclasses.replace(own, mode_count=1))
    converged = refined(limited, animation, meshes, 1e-3)
    off = np.linalg.norm(simulate_at(converged.shot, BY, STEP).positions - fine[1], axis=2).max()
    assert off > 4e-4 and converged.error_m == pytest.approx(off, rel=0.2)


def test_a_reduction_without_room_is_neither_refined_nor_meshed_again(arm, animation, meshes, monkeypatch):
    def without_room(*arguments):
        return [
            dataclasses.replace(body, limit_m=0.02 if len(body.stiffness) else 0.0)
            for body in reduce_bodies(*arguments)
        ]

    monkeypatch.setattr(body_reduction, "reduce_bodies", without_room)
    monkeypatch.setattr(module, "meshes_to_tolerance", None)
    converged = refined(arm, animation, meshes, 1e-3)
    assert converged.error_m >= 0.02
    assert count(converged.shot) == count(reduced_shot(arm, animation, meshes, RunSettings(tolerance=1e-3)))
