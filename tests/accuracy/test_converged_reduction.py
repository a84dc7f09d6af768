"""A reduction that is fine enough for the simulation: against one far finer, and no finer than it must be."""

import dataclasses

import numpy as np
import pytest
from calmotion.accuracy import converged_reduction as module
from calmotion.accuracy.converged_reduction import converged_reduction
from calmotion.accuracy.integrator_choice import FAST
from calmotion.accuracy.step_error import distance, simulate_at
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.prepare import Options, load_envelopes

STEP = 1 / 480
BY = Options(integrator=FAST)


@pytest.fixture(scope="module")
def fine(arm, animation, meshes):
    loads = load_envelopes(arm, animation, meshes, Options())
    bodies = reduce_bodies(arm, span_tree(arm), meshes, None, loads, 1e-6)
    return bodies, simulate_at(arm, animation, bodies, BY, STEP).positions


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, pytest.param(1e-4, marks=pytest.mark.long)])
def test_the_motion_keeps_the_tolerance_against_a_far_finer_reduction(arm, animation, meshes, fine, tolerance):
    settled = converged_reduction(arm, animation, meshes, Options(tolerance=tolerance, step=STEP))
    bodies = settled.bodies
    found = simulate_at(arm, animation, bodies, BY, STEP).positions
    assert np.linalg.norm(found - fine[1], axis=2).max() < tolerance and settled.error_m <= 0.4 * tolerance
    np.testing.assert_array_equal(settled.known.run.positions, found)
    if tolerance > 5e-4:
        assert sum(len(body.stiffness) for body in bodies) < sum(len(body.stiffness) for body in fine[0])


def test_a_tighter_tolerance_keeps_more(arm, animation, meshes):
    counts = [
        sum(
            len(body.stiffness)
            for body in converged_reduction(arm, animation, meshes, Options(tolerance=t, step=STEP)).bodies
        )
        for t in (1e-2, 1e-3)
    ]
    assert counts[0] < counts[1]


def test_a_shake_that_will_be_removed_needs_less_accuracy(arm, animation, meshes):
    def count(tolerance, **kwargs):
        options = Options(tolerance=tolerance, step=STEP)
        return sum(
            len(body.stiffness) for body in converged_reduction(arm, animation, meshes, options, **kwargs).bodies
        )

    loose = count(1e-3, retargeted=True)
    assert count(1e-2) <= loose < count(1e-3)


def test_fine_reductions_see_pairs_as_for_a_tenth_of_the_tolerance(arm, animation, meshes, monkeypatch):
    levels = []

    def spied(character, *arguments):
        levels.append((arguments[4], [b.flexible.pairs_share for b in character.bodies if b.flexible is not None]))
        return reduce_bodies(character, *arguments)

    monkeypatch.setattr(module, "reduce_bodies", spied)
    monkeypatch.setattr(module, "SHARE", 1e-3)  # goes on to finer ones
    monkeypatch.setattr(module, "MOST", 3)
    converged_reduction(arm, animation, meshes, Options(tolerance=1e-2, step=STEP))
    assert [level for level, _ in levels] == pytest.approx([1e-2, 1e-3, 1e-4, 1e-5])
    for (level, shares), seen in zip(levels, (1e-2, 1e-3, 1e-3, 1e-3), strict=True):
        np.testing.assert_allclose([level * share for share in shares], seen)


def test_reductions_are_compared_by_one_integrator(arm, animation, meshes, monkeypatch):
    reference_run, runs = module.reference_run, []

    def gives_way_for_the_second(character, animation, bodies, options, step):
        if len(runs) == 1:
            options = dataclasses.replace(options, integrator="bdf2")
        runs.append(reference_run(character, animation, bodies, options, step).run)
        return module.ReferenceRun(animation, runs[-1])

    monkeypatch.setattr(module, "reference_run", gives_way_for_the_second)
    monkeypatch.setattr(module, "SHARE", 1.0)  # the second will do
    settled = converged_reduction(arm, animation, meshes, Options(tolerance=1e-2, step=STEP))
    assert [run.integrator for run in runs] == [FAST, "bdf2", "bdf2", "bdf2"] and settled.known.run is runs[3]
    assert settled.error_m == distance(runs[3].positions, runs[2].positions)
