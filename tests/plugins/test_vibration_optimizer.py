import dataclasses

import numpy as np
import pytest
import synthetic
from calmotion import ShotError
from calmotion.host import NotAsked
from calmotion.model import Character, Result, SearchRecord
from calmotion.model.limits.use import LimitUse
from calmotion.model.outputs import ShapedTracks, SystemModes, Verification
from calmotion.model.run import OutputPaths, RunSettings, Source
from calmotion.simulation.compiled_shot import CompiledShot, compile_shot
from calmotion.testing import host_with, run_operator, small_shot
from calmotion.tolerance.reduced_bodies import ConvergedReduction, ReducedBodies


@pytest.fixture(scope="module")
def host(repository):
    names = ("model_analysis", "body_reduction", "vibration_optimizer")
    return host_with(*(repository / "plugins" / name for name in names))


@pytest.fixture(scope="module")
def with_mesher(repository):
    names = ("fe_mesher", "model_analysis", "body_reduction", "vibration_optimizer")
    return host_with(*(repository / "plugins" / name for name in names))


def source(command):
    # so strict that the small, stiff arm keeps its modes
    return Source("shot.usda", command, RunSettings(step=0.01, tolerance=1e-7))


def test_rigid_shots_need_neither_reduction_nor_modes(host):
    character, _ = small_shot()
    for idname in ("fem.reduce", "dynamics.modes"):
        assert "nothing is flexible" in host.operators[idname].poll({Character: character})


def test_one_of_simulate_and_optimize_runs(host):
    for command in ("simulate", "optimize"):
        other = "optimize" if command == "simulate" else "simulate"
        assert host.operators[f"retarget.{command}"].poll({Source: source(command)}) is None
        assert command in host.operators[f"retarget.{other}"].poll({Source: source(command)})


def test_simulation_of_a_rigid_shot_follows_the_animation(host):
    character, animation = small_shot()
    (result,) = run_operator(host, "retarget.simulate", [compile_shot(character, animation), source("simulate")])
    assert isinstance(result, Result) and result.after is None
    # the simulation's own error: second order in its step
    judged = result.before.motion.times >= 0.0
    assert result.before.position_errors[judged].max() < 5e-3


def test_flexible_shot_without_a_mesh_says_what_is_missing(host):
    character, animation = small_shot(flexible=True)
    with pytest.raises(ShotError) as error:
        run_operator(host, "fem.reduce", [character])
    assert "mesh" in error.value.problem and error.value.path.startswith("/")


def test_properties_reach_the_optimiser(with_mesher):
    both = with_mesher
    character, animation = small_shot(flexible=True)
    run = both.run(
        [character, animation, source("optimize")],
        [Result, SystemModes, ReducedBodies],
        settings={"retarget.optimize": {"max_iterations": 1, "knot_spacing": 0.2}},
    )
    outcomes = {result.idname: (result.outcome, result.error) for result in run}
    assert outcomes["retarget.optimize"][0] == "done", outcomes
    result = run.get(Result)
    assert result.search.gradients == 1 and result.objective_after < result.objective_before
    moving = [curve for curve in result.curves if curve.changed]
    assert moving and np.all(np.diff(moving[0].knots) > 0.15)
    frequencies, damping = run.get(SystemModes).frequencies, run.get(SystemModes).damping
    assert damping.shape == frequencies.shape and np.all(damping > 0.0) and damping[0] < 0.02
    assert np.all(np.diff(frequencies) >= 0.0) and frequencies[0] > 0.1
    assert len(run.get(ReducedBodies).bodies) == len(character.bodies)
    assert run.get(ConvergedReduction).shot.model.dof >= run.get(CompiledShot).model.dof


def test_a_result_is_verified_on_request(host, with_mesher):
    both = with_mesher
    character, animation = small_shot(flexible=True)
    asked = Source("shot.usda", "simulate", RunSettings(tolerance=1e-5), verify=True)
    run = both.run([character, animation, asked], [Result, Verification])
    outcomes = {result.idname: (result.outcome, result.error) for result in run}
    assert outcomes["retarget.verify"][0] == "done", outcomes
    found, verified = run.get(Result), run.get(Verification)
    assert found.accuracy.step_m <= 0.5e-5 and verified.step_s == pytest.approx(found.step_s / 4)
    assert 0.0 < verified.error_m < 1e-5
    poll = host.operators["retarget.verify"].poll
    assert isinstance(poll({Source: dataclasses.replace(asked, verify=False)}), NotAsked)
    assert poll({Source: asked}) is None


def test_shaped_tracks_are_simulated_on_request(host):
    character, animation = small_shot()
    (plain,) = run_operator(host, "retarget.simulate", [compile_shot(character, animation), source("simulate")])
    assert isinstance(host.operators["retarget.shape"].poll({Source: source("simulate")}), NotAsked)
    late = tuple(dataclasses.replace(track, times=track.times + 0.2) for track in animation.tracks)
    shot = compile_shot(character, animation)
    (shaped,) = run_operator(host, "retarget.simulate", [shot, source("simulate"), ShapedTracks(late)])
    assert shaped.before.position_errors.max() > 10 * plain.before.position_errors.max()
    asked = dataclasses.replace(source("simulate"), shaper="zvd")
    with pytest.raises(ShotError, match="does not vibrate has no frequency") as error:
        run_operator(host, "retarget.shape", [shot, asked])
    assert error.value.place == "--shaper"


def test_frequencies_are_sought_only_where_something_shows_them(host):
    poll = host.operators["dynamics.modes"].poll
    character, _ = small_shot(flexible=True)
    asked = {Character: character, Source: source("optimize")}
    assert isinstance(poll(asked | {OutputPaths: OutputPaths(layer="calm.usda", csv="calm.csv")}), NotAsked)
    assert poll(asked | {OutputPaths: OutputPaths(figures="pictures")}) is None
    assert poll(asked | {OutputPaths: OutputPaths(rrd="calm.rrd")}) is None
    assert poll({Character: character, Source: source("inspect"), OutputPaths: OutputPaths()}) is None


@pytest.mark.parametrize(
    ("excess", "cost", "reason"),
    [
        (-0.4, None, "the search ended: iteration limit"),
        (-1e-9, None, "the limits of the motors require it"),
        (0.2, None, "limits of motors are still exceeded. Slow the animation down there, or raise the limits"),
        (-0.4, 1e-3, "the limits of the motors require it"),
    ],
)
def test_worse_curves_are_blamed_on_limits_only_where_one_is_reached(host, monkeypatch, excess, cost, reason):
    made = dataclasses.replace(
        synthetic.result(),
        objective_after=1.0,
        search=SearchRecord(stopped="iteration limit"),
        limits=(LimitUse(0, "position", 1.0, 0.5, 1.0 + excess, 0.1, excess, cost),),
    )
    monkeypatch.setattr("calmotion.retargeting.retiming.retime.optimize_with_tempo", lambda *rest: made)
    told = []
    monkeypatch.setattr("calmotion.host.operators.RunContext.report", lambda context, level, text: told.append(text))
    run_operator(host, "retarget.optimize", [compile_shot(*small_shot()), source("optimize")])
    assert len(told) == 1 and told[0].endswith(reason)
