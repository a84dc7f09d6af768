"""The command line on plugins made for the test; the main job on a real shot is in test_wheel.py."""

import json
import os
import subprocess
import sys
from dataclasses import replace

import calmotion.workflow.shot
import numpy as np
import pytest
import synthetic
from calmotion.cli.main import main
from calmotion.errors import ShotError
from calmotion.host.discovery import Location, find_in_folder
from calmotion.host.registry import Host
from calmotion.model import Animation, Character, InputLayer, ModeTable, Provenance, Result
from calmotion.model.outputs import WrittenLayer
from calmotion.model.run import OutputPaths, RunSettings, Source
from calmotion.model.tolerance import MESH, BudgetEntry
from calmotion.tolerance.reduced_bodies import ReducedBodies
from fakes import host_of, operator
from one_hinge import ONE_HINGE

LAYERS = (InputLayer("shot.usda", "0" * 64),)
PROVENANCE = Provenance("shot.usda", LAYERS, 0.01, 1.0, "Y", 24.0, 24.0, 1.0, 25.0, "Robot")
CONTRACT = set(
    "targets objective_before objective_after forward_simulations gradients linearized_sweeps iterations wall_s "
    "total_wall_s simulate_wall_s steps step_s dof modes parameters layer left_out "
    "tolerance_m tolerance_kept error_budget".split()
)


def fake_host(repository, **changes):
    """A host that reads, simulates and writes without files; `changes` replace what an operator does."""

    def made(name, values):
        return changes.get(name, lambda context: values)

    def solve(context):
        return (synthetic.result(context.get(Source).command == "optimize"),)

    def write(context):
        return (WrittenLayer(context.get(OutputPaths).layer, "root.usda"),)

    reduced = ReducedBodies((), (ModeTable(1, np.array([4.0, 25.0]), 120, 300, 0.2),))
    read = made("read", (synthetic.character(), synthetic.animation(), PROVENANCE))
    host = host_of(
        operator("usd.read", [Source], [Character, Animation, Provenance], execute=read),
        operator("fem.reduce", [Character], [ReducedBodies], execute=made("reduce", (reduced,)),
                 poll=changes.get("reduce_poll")),
        operator("retarget.solve", [Character, Source], [Result], execute=changes.get("solve", solve)),
        operator("usd.write", [Result, OutputPaths], [WrittenLayer], execute=changes.get("write", write)),
    )  # fmt: skip
    for location in find_in_folder(repository / "plugins" / "table_writer", "bundled"):
        host.load(host.add(location))
    return host


@pytest.fixture
def run(repository, monkeypatch, capfd, tmp_path):
    """Runs a command in this process on the fake host, in an empty folder; exit status, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def command(*arguments, **changes):
        monkeypatch.setattr(calmotion.workflow.shot, "open_host", lambda folders: fake_host(repository, **changes))
        status = main([str(argument) for argument in arguments])
        captured = capfd.readouterr()
        return status, captured.out, captured.err

    return command


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from calmotion.cli.main import main; status = main(['--help']);"
        "heavy = {'numpy', 'pxr', 'rerun', 'numba', 'rich', 'scipy', 'calmotion.model'};"
        "plugins = {name for name in sys.modules if name.startswith('calmotion_plugins.')};"
        "print(status, sorted(heavy & set(sys.modules) | plugins))"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=_environment())
    assert printed.stdout.splitlines()[-1] == "0 []", printed.stderr
    assert "optimize" in printed.stdout


def _environment():
    return os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}


def test_a_shaper_is_printed_and_its_delay_only_where_it_has_one(run):
    status, out, _ = run("simulate", "shot.usda", "--shaper", "zvd")
    assert status == 0
    text = " ".join(out.split())  # lines break at the width of the terminal
    assert text.startswith("With the shaper zvd, the largest error is ")
    assert "delays the motion" not in text  # the motors of this host stand still


def test_optimize_reports_what_the_contract_names(run, tmp_path, repository):
    layer, table = tmp_path / "new" / "calm.usda", tmp_path / "table.csv"
    status, out, _ = run("optimize", "shot.usda", "-o", layer, "--csv", table, "--json")
    report = json.loads(out)
    assert status == 0 and CONTRACT <= set(report)
    (target,) = report["targets"]
    assert target["path"] == "/Robot/Tip/Target"
    # The synthetic shake is 0.03 m, of which a decaying 4 Hz sine reaches this much at its steps.
    before = np.abs(synthetic.bend(np.arange(0, 1.0001, synthetic.STEP), synthetic.SHAKE))
    assert target["max_error_before_m"] == pytest.approx(before.max(), rel=1e-9)
    assert target["rms_error_before_m"] == pytest.approx(np.sqrt(np.mean(before**2)), rel=1e-9)
    assert target["max_rotation_error_before_rad"] == pytest.approx(2 * before.max(), rel=1e-9)
    assert report["max_error_before_m"] == target["max_error_before_m"]
    assert report["layer"] == str(layer) and report["root_layer"] == "root.usda" and report["csv"] == str(table)
    assert report["modes"] == 1 and report["simulate_wall_s"] == 0.1
    assert report["left_out"][-1] == {
        "what": "modes above 40 Hz",
        "why": "the motion does not excite them",
        "estimated_error_m": 2e-5,
        "skipped": False,
    }
    assert table.is_file() and layer.parent.is_dir()
    page = (repository / "docs" / "reference" / "outputs.md").read_text()
    assert [key for key in report if f"`{key}`" not in page] == []


def test_simulate_reports_without_before_and_after(run, repository):
    status, out, _ = run("simulate", "shot.usda", "--json")
    report = json.loads(out)
    assert status == 0 and not [key for key in report if "before" in key or "after" in key]
    page = (repository / "docs" / "reference" / "outputs.md").read_text()
    assert [key for key in report if f"`{key}`" not in page] == []
    assert {
        "path",
        "max_error_m",
        "rms_error_m",
        "max_rotation_error_rad",
        "rotation_weight",
        "rms_rotation_error_rad",
        "sag_m",
        "seam_m",
    } == set(report["targets"][0])
    assert report["newton_iterations"] == 400 and report["layer"] is None


@pytest.mark.parametrize("command", [("simulate",), ("optimize", "-o", "calm.usda")])
@pytest.mark.parametrize(("mesh_m", "kept"), [(1e-4, True), (2e-3, False)])
def test_with_strict_a_tolerance_that_is_not_kept_is_a_failure_with_all_outputs(run, command, mesh_m, kept):
    def solve(context):
        entry = BudgetEntry(MESH, 1e-3, mesh_m, "900 elements in 1 flexible body", "")
        return (replace(synthetic.result(command[0] == "optimize"), tolerance_m=1e-3, budget=(entry,)),)

    status, out, _ = run(command[0], "shot.usda", *command[1:], "--json", "--strict", solve=solve)
    report = json.loads(out)
    assert status == (0 if kept else 1) and "error" not in report
    assert report["tolerance_kept"] == kept and report["tolerance_missed_by"] == (None if kept else MESH)
    assert report["tolerance_m"] == 1e-3 and report["error_budget"][0]["estimated_m"] == mesh_m
    assert (report["layer"] is None) == (command[0] == "simulate")
    assert run(command[0], "shot.usda", *command[1:], "--json", solve=solve)[0] == 0


@pytest.mark.parametrize(
    ("largest_m", "objective", "improved"),
    [
        (2e-3, 1e-5, True),
        (0.0301, 9e-3, False),
        (0.030005, 9e-3, True),
        (2e-3, 2e-2, False),
        (2e-3, float("nan"), False),
    ],
)
def test_with_strict_curves_that_leave_a_larger_error_are_a_failure(run, largest_m, objective, improved):
    def solve(context):
        made = synthetic.result()
        errors = (made.before.position_errors / made.before.position_errors.max() * size for size in (0.03, largest_m))
        before, after = (replace(made.before, position_errors=values) for values in errors)
        entry = BudgetEntry(MESH, 1e-3, 1e-4, "", "")
        changes = {"tolerance_m": 1e-3, "budget": (entry,), "objective_after": objective}
        return (replace(made, before=before, after=after, **changes),)

    words = ("optimize", "shot.usda", "-o", "calm.usda", "--json")
    status, out, _ = run(*words, "--strict", solve=solve)
    assert status == (0 if improved else 1) and json.loads(out)["improved"] is improved
    assert run(*words, solve=solve)[0] == 0


def test_errors_of_the_pre_roll_are_not_judged(run):
    def solve(context):
        result = synthetic.result(False)
        result.before.position_errors[result.before.motion.times < -1e-9] = 1.0
        return (result,)

    _, out, _ = run("simulate", "shot.usda", "--json", solve=solve)
    assert json.loads(out)["max_error_m"] < 0.03


def test_the_table_for_a_person_shows_errors_before_and_after(run):
    status, out, err = run("optimize", "shot.usda", "-o", "build/calm.usda")
    assert status == 0 and "/Robot/Tip/Target" in out and "wrote build/calm.usda" in out
    assert "mm" in out and "simplified: 1 part of the model" in out and "modes above 40 Hz (" not in out
    assert "retarget solve: done" in err
    assert out.startswith("The largest error falls from ") and "iterations" not in out
    order = [out.index(part) for part in ("largest error", "/Robot/Tip/Target", "wrote ", "next: ", "simplified: ")]
    assert order == sorted(order), "the answer first, the simplifications last"
    _, long, _ = run("optimize", "shot.usda", "-o", "build/calm.usda", "--verbose")
    assert "iterations" in long and "simplified: modes above 40 Hz (" in long


def test_quiet_prints_nothing(run):
    assert run("simulate", "shot.usda", "--quiet") == (0, "", "")


def test_json_stays_alone_on_stdout_whatever_plugins_print(calmotion_process, make_plugin):
    folder = make_plugin("noisy", "import os\nprint('hello')\nos.system('echo shell')\nraise RuntimeError('broken')")
    listed = calmotion_process("plugins", "list", "--json", "--plugins", folder)
    plugins = {plugin["id"]: plugin for plugin in json.loads(listed.stdout)["plugins"]}
    assert plugins["noisy"]["state"] == "failed" and "RuntimeError: broken" in plugins["noisy"]["traceback"]
    assert plugins["table_writer"]["state"] == "registered"
    assert "hello" in listed.stderr and "shell" in listed.stderr


def refuse(context):
    raise ShotError("has no mass", path="/Robot/Arm", attribute="physics:mass", found=0.0, remedy="Author a density.")


def test_a_shot_error_is_printed_with_place_found_and_remedy(run):
    status, out, err = run("inspect", "shot.usda", read=refuse)
    assert (status, out) == (1, "")
    for part in ("has no mass", "/Robot/Arm.physics:mass", "0.0", "Author a density."):
        assert part in err
    assert "Traceback" not in err


def test_a_shot_error_is_an_object_with_json(run):
    status, out, _ = run("optimize", "shot.usda", "-o", "build/calm.usda", "--json", read=refuse)
    error = json.loads(out)["error"]
    assert status == 1 and error["path"] == "/Robot/Arm" and error["remedy"] == "Author a density."
    assert "traceback" not in error


def explode(context):
    raise ZeroDivisionError("no fire")


def test_an_operator_that_raises_is_named_and_the_rest_is_kept(run, tmp_path):
    table = tmp_path / "table.csv"
    status, out, _ = run("optimize", "shot.usda", "-o", "build/calm.usda", "--csv", table, "--json", write=explode)
    report = json.loads(out)
    assert status == 1 and table.is_file() and CONTRACT <= set(report)
    assert report["error"]["plugin"] == "smithy" and report["error"]["operator"] == "usd.write"
    assert "in explode" in report["error"]["traceback"] and report["layer"] is None
    _, _, err = run("optimize", "shot.usda", "-o", "build/calm.usda", write=explode)
    assert "usd.write of the plugin smithy raised ZeroDivisionError" in err and "in explode" in err


def test_an_interruption_has_its_status_and_keeps_what_is_there(run):
    def interrupt(context):
        raise KeyboardInterrupt

    status, out, _ = run("optimize", "shot.usda", "-o", "build/calm.usda", "--json", write=interrupt)
    report = json.loads(out)
    assert status == 130 and report["error"]["problem"] == "interrupted" and report["objective_after"] == 1e-5


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["optimize", "shot.usda"],
        ["simulate", "shot.usda", "--step", "5kg"],
        ["simulate", "shot.usda", "--step", "-1"],
        ["simulate", "shot.usda", "--set", "retarget.solve=1"],
        ["simulate", "shot.usda", "--set", "no.such.property=1"],
        ["simulate", "shot.usda", "--settings", "no_such_file.toml"],
        ["simulate", "shot.usda", "--figures", "figures"],
        ["optimize", "shot.usda", "-o", "shot.usda"],
        ["optimize", "shot.usda", "-o", "calm.usda", "--robust", "best"],
        ["optimize", "shot.usda", "-o", "calm.usda", "--robust", "--scenarios", "4"],
    ],
)
def test_wrong_usage_has_its_status(run, arguments):
    status, out, err = run(*arguments)
    assert (status, out) == (2, "") and err


def test_options_of_the_writer_are_its_properties(run):
    """The fake writer has no properties, so the setting is refused, by the name it was passed on with."""
    status, _, err = run("optimize", "shot.usda", "-o", "build/calm.usda", "--bake=motors")
    assert status == 2 and "usd.write.bake" in err


@pytest.mark.parametrize("command", ["simulate", "inspect"])
def test_options_reach_the_plugins_in_si_units(run, command):
    seen = []

    def read(context):
        seen.append(context.get(Source))
        return (synthetic.character(), synthetic.animation(), PROVENANCE)

    run(command, "a.usda", "--step", "2ms", "--tolerance", "1mm", "--integrator", "rk4", "--pre-roll", "0.5",
        "--quiet", read=read)  # fmt: skip
    meshes = command != "inspect"  # which meshes by --meshes alone
    assert seen == [Source("a.usda", command, RunSettings(0.001, 0.002, 0.5, "rk4"), meshes=meshes)]


@pytest.mark.parametrize(
    "arguments, near",
    [
        (("optimize", "a.usda", "-o", "b.usda", "--integrator", "rk4"), "bdf2"),
        (("optimise", "a.usda", "-o", "b.usda", "--integrator", "bdf"), "Did you mean bdf2?"),
        (("simulate", "a.usda", "--integrator", "rk5"), "Did you mean rk4?"),
        (("inspect", "a.usda", "--integrator", "generalised-alpha"), "Did you mean generalized-alpha?"),
        (("simulate", "a.usda", "--shaper", "zdv"), "Did you mean"),
    ],
)
def test_an_integrator_or_shaper_that_the_command_does_not_have_is_refused_before_reading(run, arguments, near):
    def read(context):
        raise AssertionError("nothing is read")

    status, _, err = run(*arguments, read=read)
    assert status == 2 and arguments[-2] in err and arguments[-1] in err and near in err


def test_inspect_reports_bodies_motors_and_frequencies(run):
    status, out, _ = run("inspect", "shot.usda", "--json")
    report = json.loads(out)
    assert status == 0 and report["units"]["meters_per_unit"] == 0.01
    assert [body["kind"] for body in report["bodies"]] == ["rigid", "flexible", "rigid"]
    assert report["bodies"][1]["frequencies_hz"] == [4.0, 25.0] and report["bodies"][1]["mass_kg"] == 0.2
    (motor,) = report["motors"]
    assert motor["max_rad"] == pytest.approx(np.pi / 2) and motor["max_velocity_rad_s"] == 6.0
    assert motor["max_torque_n_m"] is None and motor["upper_rad"] == 2.0
    assert report["joints"][0]["body0"] == "" and report["left_out"] == []


def test_inspect_reports_simplifications(run):
    status, out, _ = run("inspect", "shot.usda", "--verbose", reduce_poll=lambda data: "nothing is flexible")
    assert status == 0 and "skipped: fem reduce (nothing is flexible)" in out
    assert "-114.6° .. 114.6°" in out  # the joint's limits, 2 rad


def test_inspecting_a_rigid_shot_imports_neither_finite_elements_nor_rerun(tmp_path):
    shot = tmp_path / "rigid.usda"
    shot.write_text(ONE_HINGE)
    code = (
        "import json, sys; from calmotion.cli.main import main; status = main(['inspect', sys.argv[1], '--json']);"
        "print(json.dumps([status, sorted(sys.modules)]), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, shot], capture_output=True, text=True, env=_environment(), cwd=tmp_path
    )
    status, modules = json.loads(done.stderr.splitlines()[-1])
    report = json.loads(done.stdout)
    assert status == 0 and report["motors"][0]["max_rad"] == pytest.approx(np.pi / 6)
    assert report["bodies"] == [{"path": "/Robot/Link", "kind": "rigid", "simulated": "rigid", "mass_kg": 2.0}]
    assert {row["what"] for row in report["left_out"]} == {
        "Tetrahedralise flexible bodies",
        "Reduce flexible bodies",
        "Compute the natural frequencies",
        "Choose the time step",
    }
    heavy = ("rerun", "skfem", "trimesh", "pytetwild", "meshio", "numba", "matplotlib", "calmotion.fem")
    assert not [name for name in modules if name.startswith(heavy)]


def test_plugins_list_shows_operators_with_their_properties(calmotion):
    listed = calmotion("plugins", "list")
    assert listed.returncode == 0, listed.stderr
    assert "table.write" in listed.stdout and "-> CsvFile" in listed.stdout


def test_plugins_check_names_what_is_wrong(calmotion, make_plugin, repository):
    good = calmotion("plugins", "check", repository / "plugins" / "table_writer")
    assert (good.returncode, good.stderr) == (0, ""), good.stdout
    bad = calmotion("plugins", "check", make_plugin("anvil", "", version="one"))
    assert bad.returncode == 1 and "is not a version" in bad.stdout


def test_a_host_without_a_reader_names_the_plugins_that_failed(make_plugin, run, monkeypatch):
    host = Host()
    host.add(Location(make_plugin("reader", "", version="one"), "test"))
    monkeypatch.setattr(calmotion.workflow.shot, "open_host", lambda folders: host)
    with pytest.raises(ShotError, match="reader .*is not a version"):
        list(host.run([Source("a.usda", "inspect")], [Character]))
