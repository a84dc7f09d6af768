"""Tolerances: the step follows from them, and what comes out keeps them against a far finer run."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from arms import chain
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import Animation, Track
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.retargeting import to_tolerance as retarget
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.simulation.bodies import with_elasticity
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance import simulation as to_tolerance
from calmotion.tolerance import step_choice
from calmotion.tolerance.pod_subspace import ProjectedShot
from calmotion.tolerance.simulation import found_tracks, planned_step, simulate_to_tolerance
from calmotion.tolerance.step_choice import WHOLE
from calmotion.tolerance.step_error import CLOSED_GAP, distance, frames_of_result, simulate_at
from made_shots import reduced_shot

FINE = 1 / 3840


def quiet(fraction, message):
    pass


@pytest.fixture(scope="module")
def fine(arm, animation, bodies):
    """The animation by a far finer step."""
    return simulate_at(compile_shot(arm, animation, bodies), RunSettings(), FINE)


def off_by(result, character, animation, bodies, fine=None):
    """Largest distance of a target at a frame to where a far finer step has it."""
    simulation = result.after or result.before
    if result.after is not None:
        animation = replace(animation, current=found_tracks(result, animation))
    fine = fine or simulate_at(compile_shot(character, animation, bodies), RunSettings(), FINE)
    frames = np.searchsorted(simulation.motion.times, animation.frame_times - 1e-9)
    return np.linalg.norm(simulation.motion.target_positions[frames] - fine.positions, axis=2).max()


def test_a_simulation_keeps_its_tolerance_by_a_step_no_smaller_than_it_must(arm, animation, bodies, fine):
    steps = []
    for tolerance in (1e-2, 1e-3, 1e-4):
        result = simulate_to_tolerance(compile_shot(arm, animation, bodies), RunSettings(tolerance=tolerance), quiet)
        off = off_by(result, arm, animation, bodies, fine)
        assert off < tolerance and off < 1.5 * result.accuracy.step_m
        steps.append(result.step_s)
        coarser = simulate_at(compile_shot(arm, animation, bodies), RunSettings(), 4.0 * result.step_s)
        assert np.linalg.norm(coarser.positions - fine.positions, axis=2).max() > 0.5 * tolerance
    assert steps[0] > steps[1] > steps[2]


@pytest.mark.parametrize("options", [RunSettings(tolerance=1e-2), RunSettings(step=1 / 120)])
def test_efforts_are_stated_with_their_error(arm, animation, bodies, fine, options):
    shot = compile_shot(arm, animation, bodies)
    result = simulate_to_tolerance(shot, options, quiet)
    efforts = frames_of_result(result, animation.frame_times).efforts
    off, largest = np.abs(efforts - fine.efforts).max(axis=0), np.abs(efforts).max(axis=0)
    assert np.all(off < 1.5 * result.accuracy.efforts)
    assert np.all(result.accuracy.efforts < 0.5 * largest)


def test_the_step_takes_what_all_else_leaves_of_the_tolerance(arm, animation, bodies):
    options = RunSettings(tolerance=1e-3)
    none, some, much, more = (
        simulate_to_tolerance(compile_shot(arm, animation, bodies), options, quiet, left_out_m=left_out).accuracy
        for left_out in (0.0, 4e-4, 8e-4, 2e-3)
    )
    assert 0.4e-3 < none.step_m <= 0.75e-3
    assert 0.25e-3 < some.step_m <= 0.5e-3 and some.estimated_m <= 0.9e-3
    assert 0.05e-3 < much.step_m <= 0.1e-3 and much.estimated_m <= 0.9e-3
    assert 0.2e-3 < more.step_m <= 0.35e-3  # smaller steps would be in vain


def test_the_step_leaves_the_tolerance_to_meshes(arm, animation, bodies):
    options, flexible = RunSettings(tolerance=1e-3), [len(body.stiffness) > 0 for body in bodies]
    worse = [replace(b, mesh_error=7e-4 if f else None) for b, f in zip(bodies, flexible, strict=True)]
    found = simulate_to_tolerance(compile_shot(arm, animation, worse), options, quiet).accuracy
    others = found.mesh_m
    assert 0.2e-3 < others < 0.8e-3 and 0.3 * (0.9e-3 - others) < found.step_m <= 0.95e-3 - others


def test_joints_stay_closed_where_motors_determine_the_motion():
    """Targets are where they should be by any step then, but velocities oscillate, and joints opened by 0.03 mm."""
    shot, times = chain(3, driven=(0, 1, 2), length=0.5), np.linspace(0.0, 1.0, 61)
    chosen = set()
    for frequency in (0.2, 0.4, 1.0, 3.0):
        swing = np.sin(2.0 * np.pi * frequency * times) ** 3
        tracks = tuple(Track(times, factor * swing) for factor in (0.5, 0.8, -0.6))
        moved = Animation(times, tracks, tracks)
        for integrator in (None, "newmark", "bdf2"):
            options = RunSettings(tolerance=2e-2, integrator=integrator)
            try:
                result = simulate_to_tolerance(compile_shot(shot, moved), options, quiet)
            except IntegrationError as error:
                assert integrator == "newmark" and "come apart" in str(error)
                continue
            assert result.before.max_joint_gap <= CLOSED_GAP
            chosen.add((integrator, result.left_out[-1].why.split(" with ")[1]))
    assert {(None, "generalised-alpha"), (None, "BDF2")} <= chosen


def test_frames_shorter_than_the_first_steps(arm, moves, bodies):
    fast = moves(120.0)
    result = simulate_to_tolerance(compile_shot(arm, fast, bodies), RunSettings(tolerance=1e-2), quiet)
    assert result.step_s <= 1 / 120 and off_by(result, arm, fast, bodies) < 1e-2


def test_the_step_that_is_planned_is_the_one_that_is_taken(arm, animation, bodies, monkeypatch):
    plain = step_choice.simulate_at

    def fails(shot, options, step):
        if options.scheme != "bdf2":
            raise IntegrationError("diverges")
        return plain(shot, options, step)

    options = RunSettings(tolerance=1e-3)
    for gives_way in (False, True):
        if gives_way:
            monkeypatch.setattr(step_choice, "simulate_at", fails)
        row = planned_step(compile_shot(arm, animation, bodies), options)
        taken = simulate_to_tolerance(compile_shot(arm, animation, bodies), options, quiet)
        assert astuple(row) == astuple(taken.left_out[-1])
        assert row.why.endswith("BDF2") == gives_way


def test_a_given_step_is_taken_and_its_error_estimated(arm, animation, bodies, fine):
    result = simulate_to_tolerance(
        compile_shot(arm, animation, bodies), RunSettings(step=1 / 240, tolerance=1e-5), quiet
    )
    assert result.step_s == pytest.approx(1 / 240)
    assert off_by(result, arm, animation, bodies, fine) == pytest.approx(result.accuracy.step_m, rel=0.5)
    slow = replace(arm, retarget=replace(arm.retarget, time_step=1 / 120))
    result = simulate_to_tolerance(compile_shot(slow, animation, bodies), RunSettings(tolerance=1e-5), quiet)
    assert result.step_s == pytest.approx(1 / 120)


def test_without_a_requested_tolerance_that_of_the_shot_is_kept(arm, animation, bodies, fine):
    steps = []
    for tolerance in (None, 1e-2, 1e-4):
        shot = replace(arm, retarget=replace(arm.retarget, tolerance=tolerance))
        result = simulate_to_tolerance(compile_shot(shot, animation, bodies), RunSettings(), quiet)
        assert off_by(result, arm, animation, bodies, fine) < tolerance_of(shot)
        steps.append(result.step_s)
    assert steps[1] > steps[0] > steps[2]


def test_the_integrator_that_needs_fewest_steps_gives_way_where_it_fails(arm, animation, bodies, monkeypatch):
    options = RunSettings(tolerance=1e-3)
    fast = simulate_to_tolerance(compile_shot(arm, animation, bodies), options, quiet)
    asked = simulate_to_tolerance(compile_shot(arm, animation, bodies), replace(options, integrator="bdf2"), quiet)
    assert fast.left_out[-1].why.endswith("with generalised-alpha") and asked.left_out[-1].why.endswith("with BDF2")
    assert fast.step_s > 1.5 * asked.step_s
    plain = to_tolerance.simulate_shot

    def comes_apart(shot, options, progress):
        if options.scheme != "bdf2":
            raise IntegrationError("its joints come apart")
        return plain(shot, options, progress)

    monkeypatch.setattr(to_tolerance, "simulate_shot", comes_apart)
    found = simulate_to_tolerance(compile_shot(arm, animation, bodies), options, quiet)
    assert found.step_s == asked.step_s and found.left_out[-1].why == asked.left_out[-1].why
    with pytest.raises(ShotError):
        simulate_to_tolerance(compile_shot(arm, animation, bodies), replace(options, integrator="newmark"), quiet)


@pytest.mark.parametrize("tolerance", [1e-3, 2e-5])
def test_an_optimisation_keeps_its_tolerance(arm, animation, bodies, tolerance):
    result = optimize_to_tolerance(compile_shot(arm, animation, bodies), RunSettings(tolerance=tolerance), quiet)
    off = off_by(result, arm, animation, bodies)
    assert off < 1.5 * result.accuracy.step_m and off < tolerance
    assert result.accuracy.estimated_m <= WHOLE * tolerance
    assert result.objective_after < 0.1 * result.objective_before
    assert result.accuracy.left_out_m == sum(row.estimated_error_m or 0.0 for b in bodies for row in b.left_out)


def test_a_resumed_search_counts_all_its_work(arm, animation, bodies, monkeypatch):
    parts = []
    plain = retarget.optimize_shot

    def counted(*arguments, **named):
        parts.append(plain(*arguments, **named))
        return parts[-1]

    monkeypatch.setattr(retarget, "optimize_shot", counted)
    result = optimize_to_tolerance(compile_shot(arm, animation, bodies), RunSettings(tolerance=2e-5), quiet)
    assert len(parts) == 2 and result.step_s == parts[1].step_s < parts[0].step_s
    for name in ("forward_simulations", "linearized_sweeps", "iterations", "gradients"):
        assert getattr(result.search, name) == sum(getattr(part.search, name) for part in parts)
    work = [step.forward_simulations + step.linearized_sweeps for step in result.search.steps]
    assert work == sorted(work) and len(work) == sum(len(part.search.steps) for part in parts)
    assert parts[1].search.steps[0].objective < 1.5 * parts[0].objective_after, "it goes on from what was found"


def test_an_optimisation_without_a_tolerance_reports_the_error_of_its_step(arm, animation, bodies):
    options = RunSettings(step=1 / 240)
    result = optimize_to_tolerance(compile_shot(arm, animation, bodies), options, quiet)
    assert result.step_s == pytest.approx(1 / 240)
    assert off_by(result, arm, animation, bodies) == pytest.approx(result.accuracy.step_m, rel=0.5)


def test_a_search_continues_where_the_pod_subspace_does_not_fit(arm, animation, meshes, monkeypatch):
    shot = reduced_shot(with_elasticity(arm, "stvk"), animation, meshes, RunSettings(tolerance=1e-3))
    asked, compared, parts = [], [], []
    plain_hold, plain_finer, plain_search = (
        ProjectedShot.is_accurate_for, ProjectedShot.finer_run, retarget.optimize_shot
    )  # fmt: skip

    def is_accurate_for(self, more):
        asked.append(more.animation.current)
        return plain_hold(self, more) and False

    def finer_run(self, step, options, tracks):
        compared.append(tracks)
        return plain_finer(self, step, options, tracks)

    def search(shot, *more, **named):
        parts.append(shot)
        return plain_search(shot, *more, **named)

    monkeypatch.setattr(ProjectedShot, "is_accurate_for", is_accurate_for)
    monkeypatch.setattr(ProjectedShot, "finer_run", finer_run)
    monkeypatch.setattr(retarget, "optimize_shot", search)
    result = optimize_to_tolerance(shot, RunSettings(max_iterations=15, step=1 / 480), quiet)
    # the second search ends near the first one's motion, with which the subspaces were chosen
    assert len(asked) == len(compared) == 1 and len(parts) == 2
    begun, gone_on = parts
    assert begun.animation.current is animation.current
    assert gone_on.animation.current is asked[0] is not compared[0]
    assert sum(len(body.stiffness) for body in begun.bodies) < sum(len(body.stiffness) for body in shot.bodies)
    # the frequencies are those of the links, not those of their POD subspaces
    assert [len(table.frequencies) for table in result.modes] == [len(body.stiffness) for body in shot.bodies[:2]]
    subspaces = [row for row in result.left_out if "POD subspace" in row.what]
    assert len(subspaces) == 2
    whole = simulate_at(shot.with_tracks(compared[0]), RunSettings(), 1 / 480)
    assert distance(whole.positions, frames_of_result(result, animation.frame_times).positions) < 1e-4
