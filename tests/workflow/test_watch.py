"""A watched shot is run again when it is saved, and keeps what its change leaves as it was."""

import argparse
import os
import re
import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from calmotion.cli.commands.watch import _tell
from calmotion.cli.main import main
from calmotion.cli.output import Output
from calmotion.errors import ShotError
from calmotion.host import Operator
from calmotion.host.plan import Plan
from calmotion.host.run import Run
from calmotion.model import Animation, Character, FEMeshes, ModelChoices, Result
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.tolerance.reduced_bodies import ConvergedReduction, RunMemory
from calmotion.workflow.commands import optimize, simulate
from calmotion.workflow.shot import Shot
from calmotion.workflow.watch import Watch, _growth, largest_error
from one_hinge import HINGE, ONE_HINGE, TIP

STEP = "10ms"


@pytest.fixture
def shot_file(tmp_path):
    path = tmp_path / "shot.usda"
    path.write_text(ONE_HINGE)
    return path


def middle(result):
    """The motor's angle half way [deg]."""
    return np.degrees(np.interp(0.5, result.times, result.motors[HINGE].output))


def save(path, text):
    """Write a file as an editor does: the new one takes its place."""
    new = path.with_suffix(".new")
    new.write_text(text)
    os.replace(new, path)


def test_a_saved_shot_is_run_again_with_its_new_motion(shot_file):
    watch = Watch(Shot(shot_file), partial(simulate, step=STEP))
    first = watch.run()
    assert not watch.wait(0.3), "nothing was saved"
    save(shot_file, ONE_HINGE.replace("30", "25"))
    assert watch.wait(600.0)
    second = watch.run()
    assert middle(first) == pytest.approx(30.0, rel=1e-6)
    assert middle(second) == pytest.approx(25.0, rel=1e-6)
    path, error, moment = largest_error(second)
    assert path == TIP and error == second.max_error and 0.0 <= moment <= 1.0


def test_a_layer_of_the_shot_is_watched_as_well(shot_file, tmp_path):
    root = tmp_path / "root.usda"
    root.write_text(ONE_HINGE.split("\n", 1)[0] + "\n(\n    subLayers = [@./shot.usda@]\n" + header(ONE_HINGE) + ")\n")
    watch = Watch(Shot(root), partial(simulate, step=STEP))
    watch.run()
    save(shot_file, ONE_HINGE.replace("30", "25"))
    assert watch.wait(600.0)
    assert middle(watch.run()) == pytest.approx(25.0, rel=1e-6)


def header(text):
    """The metadata of a layer."""
    return re.search(r"\(\n(.*?)\n\)\n", text, re.S).group(1) + "\n"


def test_a_shot_that_is_broken_for_a_while_is_run_when_it_is_whole_again(shot_file):
    watch = Watch(Shot(shot_file), partial(simulate, step=STEP))
    before = watch.run()
    save(shot_file, ONE_HINGE[: len(ONE_HINGE) // 2])
    assert watch.wait(600.0)
    with pytest.raises(ShotError):
        watch.run()
    save(shot_file, ONE_HINGE)
    assert watch.wait(600.0)
    np.testing.assert_array_equal(watch.run().targets[TIP].position, before.targets[TIP].position)


def test_a_search_begins_with_the_changes_of_the_last_one(shot_file):
    watch = Watch(Shot(shot_file), partial(optimize, step=STEP))
    first = watch.run()
    (curve,) = first.result.curves
    curve = replace(curve, changed=True, frame_values=curve.frame_values + 0.01)
    watch._last = {**watch._last, Result: replace(first.result, curves=(curve,))}
    watch.shot.forget()
    changed = watch._with_last_changes(watch.shot.animation)
    frames = watch.shot.animation.frame_times
    intended = np.interp(frames, first.times, first.motors[HINGE].input)
    np.testing.assert_allclose(changed.current[0].values, intended + 0.01, atol=1e-4)
    assert changed.tracks is watch.shot.animation.tracks and watch.reused[-1] == "curves"


def test_meshes_are_kept_for_the_same_character_only(shot_file):
    """The choice alone, with a value in place of the meshes: nothing of this shot is flexible."""

    class Meshing(Operator):
        idname, label, provides = "test.mesh", "Mesh", (FEMeshes,)

    watch = Watch(Shot(shot_file), partial(simulate, step=STEP))
    data = watch.run().outcome.run.data
    kept = data[FEMeshes] = FEMeshes(())
    given = {Character: data[Character], Animation: data[Animation], ModelChoices: data[ModelChoices]}
    assert watch._reuse(Meshing, given) == [kept] and watch.reused[-1] == "meshes"
    character = data[ModelChoices].character
    heavier = replace(character, bodies=(*character.bodies[:-1], replace(character.bodies[-1], mass=9.0)))
    assert watch._reuse(Meshing, given | {ModelChoices: replace(data[ModelChoices], character=heavier)}) is None


def test_loads_are_compared_component_by_component():
    ones = np.ones(3)
    load = LoadEnvelope(9.81 * ones, ones, ones, np.ones((2, 3)), np.ones((2, 3)), 2.0, np.ones(2))
    assert _growth(load, load) == pytest.approx(1.0)
    assert _growth(replace(load, moment=2.1 * load.moment), load) == pytest.approx(2.0)
    assert _growth(replace(load, frequency=6.0), load) == pytest.approx(3.0)
    assert _growth(replace(load, closed_chain=True), load) == np.inf
    assert _growth(replace(load, force=np.ones((3, 3))), load) == np.inf
    still = replace(load, angular_velocity=np.zeros(3))
    assert _growth(load, still) == np.inf and _growth(still, load) == pytest.approx(1.0)


def test_what_a_run_took_over_and_what_it_made_are_told(shot_file, capsys):
    """The report alone: the meshes and the memory of a flexible robot beside the values of this one."""
    memory = RunMemory()
    converged = ConvergedReduction(None, 0.0, None, memory=memory)

    def run(shot):
        result = simulate(shot, step=STEP)
        result.outcome.run.data.update({FEMeshes: FEMeshes((None,)), ConvergedReduction: converged})
        memory.projected, memory.step = "subspaces", 1e-3
        return result

    watch = Watch(Shot(shot_file), run)
    watch.run()
    assert (watch.reused, watch.made) == ([], ["meshes", "reduction", "subspaces", "time step"])
    memory.taken += ["time step", "time step"]
    watch._last = {}  # else it would be forgotten, as that of the run before
    result = watch.run()
    assert (watch.reused, watch.made) == (["time step"], ["meshes", "reduction", "subspaces"])
    args = argparse.Namespace(quiet=False, optimize=False, verbose=True, strict=False)
    report = result.report() | {"reused": watch.reused, "made": watch.made, "seconds": 1.0}
    _tell(result, report, args, Output(sys.stdout, False))
    told = capsys.readouterr().out
    assert told.endswith("; reused time step; made meshes, reduction, subspaces\n")
    args.verbose = False
    _tell(result, report, args, Output(sys.stdout, False))
    assert f"{capsys.readouterr().out.strip()}; reused" in told
    watch._last = {ConvergedReduction: converged}
    watch.run()
    assert watch.reused == []


def test_an_operator_whose_values_are_known_does_not_run():
    class Making(Operator):
        idname, label, provides = "test.make", "Make", (FEMeshes,)

        def execute(self, context):
            raise AssertionError("its value is known")

    known = FEMeshes(())
    run = Run(
        Plan((Making,), (FEMeshes,), ()), {}, {"test.make": None}, {"test.make": "test"}, reuse=lambda *_: [known]
    )
    assert run.finish().get(FEMeshes) is known and run.results[0].success


def test_the_command_prints_one_line_for_each_run(shot_file, capsys):
    assert main(["watch", str(shot_file), "--runs", "1", "--step", STEP]) == 0
    said = capsys.readouterr()
    assert re.search(r"simulated in \d+\.\d\d s: largest error .* of .* at .* s, tolerance (kept|missed)", said.out)
    assert "Ctrl-C" in said.err
    assert main(["watch", str(shot_file), "--optimize"]) == 2
    assert "-o" in capsys.readouterr().err


def test_the_exit_status_is_that_of_the_last_run(shot_file, tmp_path):
    assert main(["watch", str(shot_file), "--runs", "1", "--step", STEP, "--quiet"]) == 0
    assert main(["watch", str(tmp_path / "none.usda"), "--runs", "1", "--quiet"]) == 1
