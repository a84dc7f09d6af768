"""The analysis in the pipeline: what it simplifies is not run, and everything can be forced."""

import dataclasses
import sys

import pytest
from calmotion import ShotError
from calmotion.host import NotAsked
from calmotion.model import Character, FEMeshes, ModelChoices, Result, Simplification
from calmotion.model.model_choice import ON
from calmotion.model.outputs import MotorEffects, PlannedStep
from calmotion.model.run import OutputPaths, RunSettings, Source
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.testing import host_with, run_operator, small_shot
from simplification_shots import clevis_arm, mixed_arm


@pytest.fixture(scope="module")
def host(repository):
    plugins = repository / "plugins"
    names = ("fe_mesher", "model_analysis", "body_reduction", "vibration_optimizer")
    return host_with(*(plugins / name for name in names))


def _source(command="simulate", **more):
    return Source("shot.usda", command, RunSettings(step=1 / 120), **more)


def _outcomes(run):
    return {result.idname: (str(result.outcome), result.reason) for result in run.results}


def test_bodies_that_are_forced_to_be_rigid_are_neither_meshed_nor_reduced(host):
    shot = mixed_arm()
    forced = {"accuracy.analyse": {"bodies": "off"}}
    run = host.run([shot.character, shot.animation, _source()], [Result], settings=forced).finish()
    for idname in ("fe.mesh", "fem.reduce"):
        assert _outcomes(run)[idname] == ("left out", "the user forced all bodies to be rigid")
    result = run.get(Result)
    assert run.get(FEMeshes) is None and result.skins == (None,) * 3
    rows = {row.what: row for row in result.left_out}
    assert rows["/Arm/Link0: rigid"].why == "forced by the user"
    assert sum("/Arm/Link0" in row.what and "rigid" in row.what for row in result.left_out) == 1


def test_stiff_bodies_are_meshed_without_being_forced(host):
    shot = mixed_arm()
    given = [shot.character, shot.animation, _source()]
    lean = host.run(given, [FEMeshes]).finish()
    assert [mesh.body for mesh in lean.get(FEMeshes).meshes] == [0, 1]
    full = host.run(given, [FEMeshes], settings={"accuracy.analyse": {"bodies": "on"}}).finish()
    assert [mesh.body for mesh in full.get(FEMeshes).meshes] == [0, 1]


def test_the_step_counts_in_the_accuracy(host):
    shot = mixed_arm()
    given = [shot.character, shot.animation, Source("shot.usda", "simulate", RunSettings(tolerance=1e-3))]
    result = host.run(given, [Result]).finish().get(Result)
    steps = [row for row in result.left_out if row.what.startswith("time step")]
    assert len(steps) == 1 and "tolerance of 1 mm" in steps[0].why
    assert steps[0].estimated_error_m == result.accuracy.step_m


def test_mode_shapes_need_finite_elements(host):
    shot = mixed_arm()
    given = [shot.character, shot.animation, _source("inspect"), OutputPaths(modes="somewhere")]
    (choices,) = run_operator(host, "accuracy.analyse", given)
    assert choices.character.bodies[0].simulated_flexible and choices.forced == {"bodies": ON}


def test_forces_of_a_redundant_joint_are_zero_and_the_other_joints_carry_them(host):
    shot = clevis_arm(1)
    result = host.run([shot.character, shot.animation, _source()], [Result]).finish().get(Result)
    forces = result.before.motion.joint_forces
    assert not forces[:, 1].any() and abs(forces[:, 0]).max() > 5.0


def test_an_inspection_plans_the_step_where_one_matters(host):
    shot = mixed_arm()
    run = host.run([shot.character, shot.animation, _source("inspect")], [ModelChoices, PlannedStep]).finish()
    row = run.get(PlannedStep).row
    assert row.what == "time step 8.33 ms" and row.why == "given by --step"
    assert 0.0 < row.estimated_error_m < 0.1
    poll = host.operators["accuracy.step"].poll
    character, _ = small_shot()
    assert "motors alone" in poll({Character: character, Source: _source("inspect")})
    assert isinstance(poll({Source: _source("simulate")}), NotAsked)


def test_of_a_long_shot_an_inspection_simulates_the_busiest_part(host, monkeypatch):
    shot, seen = mixed_arm(), []
    monkeypatch.setattr(sys.modules[host.operators["accuracy.step"].__module__], "LONG_SHOT", 0.25)
    monkeypatch.setattr(
        "calmotion.tolerance.simulation.planned_step",
        lambda shot, options: seen.append(shot) or Simplification("time step 2 ms", "planned"),
    )
    given = [shot.character, shot.animation, compile_shot(shot.character, shot.animation), _source("inspect")]
    (step,) = run_operator(host, "accuracy.step", given)
    assert step.row.why == "planned" and len(seen) == 1
    assert seen[0].animation.frame_times[-1] == pytest.approx(0.25, abs=0.05)
    assert shot.animation.frame_times[-1] > 0.5


def test_an_inspection_goes_on_where_the_gains_cannot_hold_the_robot(host, monkeypatch):
    character, animation = small_shot()
    motors = tuple(dataclasses.replace(motor, position_gain=1e-3) for motor in character.motors)
    character = dataclasses.replace(character, motors=motors)

    def failing(*given):
        raise ShotError("it falls", path="/Arm")

    monkeypatch.setattr("calmotion.tolerance.motors.motor_effects.by_fast_scheme", failing)
    given = [character, animation, compile_shot(character, animation), _source("inspect")]
    assert host.run(given, [MotorEffects]).finish().get(MotorEffects).motors == ()


def test_unknown_kinds_are_wrong_usage(calmotion):
    wrong = calmotion("simulate", "shot.usda", "--keep", "everything")
    assert wrong.returncode == 2 and "turning" in wrong.stderr
