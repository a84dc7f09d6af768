"""The extension of Blender: what can be checked without Blender, and, where there is one, the whole way.

`make blender-test` makes an environment with Blender's Python module and runs all of it; otherwise name its interpreter
with CALMOTION_BLENDER_PYTHON.
"""

import ast
import importlib.util
import json
import os
import re
import shlex
import subprocess
import sys
import time
import tomllib
import zipfile
from pathlib import Path

import numpy as np
import pytest
from calmotion.usd import schemas

schemas.register()

HERE = Path(__file__).resolve().parent
EXTENSION = HERE.parents[1] / "plugins" / "blender"
BLENDER = os.environ.get("CALMOTION_BLENDER_PYTHON", "")
needs_blender = pytest.mark.skipif(not BLENDER, reason="no Blender: see make blender-test")


def loaded(name):
    """A module of the extension that does not need Blender."""
    spec = importlib.util.spec_from_file_location(f"blender_{name}", EXTENSION / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[f"blender_{name}"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def pipeline():
    """The module that runs calmotion."""
    return loaded("pipeline")


def test_the_manifest_has_the_fields_that_blender_requires():
    manifest = tomllib.loads((EXTENSION / "blender_manifest.toml").read_text())
    assert manifest["schema_version"] == "1.0.0" and manifest["type"] == "add-on"
    assert re.fullmatch(r"\d+\.\d+\.\d+", manifest["version"])
    assert len(manifest["tagline"]) <= 64 and manifest["tagline"][-1].isalnum()
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert all(len(text) <= 64 and text[-1].isalnum() for text in manifest["permissions"].values())


def test_the_licence_is_kept_apart(repository):
    assert "GNU GENERAL PUBLIC LICENSE" in (EXTENSION / "LICENSE").read_text()
    for file in EXTENSION.glob("*.py"):
        assert file.read_text().startswith("# SPDX-License-Identifier: GPL-3.0-or-later")
    outside = [f for f in (repository / "pipeline").rglob("*.py")] + [*(repository / "plugins").glob("[!b]*/*.py")]
    for file in outside:
        names = [
            n for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.Import) for n in node.names
        ]
        assert not any(name.name == "bpy" for name in names), file


def test_materials_are_those_of_the_rigger():
    from calmotion.catalogs.materials import MATERIALS

    (node,) = [n for n in ast.parse((EXTENSION / "settings.py").read_text()).body if isinstance(n, ast.Assign)]
    assert set(ast.literal_eval(node.value)) == set(MATERIALS)


def script(tmp_path: Path, text: str) -> list[str]:
    """A program that stands in for calmotion."""
    file = tmp_path / "program.py"
    file.write_text("import sys, json, time\n" + text, encoding="utf-8")
    return [sys.executable, str(file)]


def job(pipeline, command, tmp_path, **options):
    settings = {"robot": "", "material": "pla", "flexible": "a, b", "tolerance": 0.001} | options
    return pipeline.job_for(command, tmp_path / "shot.usda", tmp_path, **settings)


def test_a_skin_is_rigged_and_then_optimised(pipeline, tmp_path):
    rig, optimize = job(pipeline, ["calmotion"], tmp_path).commands
    assert rig[:3] == ("calmotion", "rig", str(tmp_path / "shot.usda")) and "rig.skeleton.flexible=a,b" in rig
    assert optimize[1:3] == ("optimize", str(tmp_path / "robot.usda")) and "0.001m" in optimize


def test_a_robot_of_one_s_own_is_put_over_the_shot(pipeline, tmp_path):
    from pxr import Sdf, Usd

    (tmp_path / "shot.usda").write_text(
        '#usda 1.0\n(\n    endTimeCode = 25\n    metersPerUnit = 1\n    timeCodesPerSecond = 24\n    upAxis = "Z"\n)\n'
        'def Xform "root"\n{\n}\n'
    )
    (tmp_path / "own.usda").write_text('#usda 1.0\nover "root"\n{\n    def Xform "Robot"\n    {\n    }\n}\n')
    (command,) = job(pipeline, ["calmotion"], tmp_path, robot=str(tmp_path / "own.usda")).commands
    stage = Usd.Stage.Open(str(tmp_path / "robot.usda"))
    assert command[1] == "optimize" and stage.GetPrimAtPath("/root/Robot")
    assert stage.GetEndTimeCode() == 25 and stage.GetTimeCodesPerSecond() == 24
    assert Sdf.Layer.FindOrOpen(str(tmp_path / "robot.usda")).pseudoRoot.GetInfo("metersPerUnit") == 1.0


def test_a_layer_on_another_drive_is_named_as_a_whole(pipeline, tmp_path, monkeypatch):
    def on_another_drive(path, start):
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr(pipeline.os.path, "relpath", on_another_drive)
    (tmp_path / "shot.usda").write_text("#usda 1.0\n")
    text = pipeline.composed(str(tmp_path / "own.usda"), tmp_path / "shot.usda", tmp_path / "robot.usda")
    assert f"@{(tmp_path / 'own.usda').as_posix()}@" in text


@pytest.mark.parametrize(
    ("command", "windows", "words"),
    [
        (r"C:\Users\Jörg\env\Scripts\calmotion.exe", True, [r"C:\Users\Jörg\env\Scripts\calmotion.exe"]),
        (r'"C:\Program Files\env\calmotion.exe" --x', True, [r"C:\Program Files\env\calmotion.exe", "--x"]),
        (r"C:\env\python.exe -m calmotion", True, [r"C:\env\python.exe", "-m", "calmotion"]),
        ("/opt/calmotion/bin/calmotion", False, ["/opt/calmotion/bin/calmotion"]),
        ("'/Applications/My Tools/calmotion'", False, ["/Applications/My Tools/calmotion"]),
        ("/opt/python -m calmotion", False, ["/opt/python", "-m", "calmotion"]),
        ("", False, []),
    ],
)
def test_the_command_is_written_as_on_the_system(pipeline, command, windows, words):
    assert pipeline.words_of(command, windows) == words


@pytest.mark.posix
def test_a_program_may_have_spaces_in_its_path_without_quotes(pipeline, tmp_path):
    program = tmp_path / "My Tools" / "calmotion"
    program.parent.mkdir()
    program.touch(0o700)
    assert pipeline.words_of(f" {program} ", False) == [str(program)]


def test_the_errors_of_a_table_are_read_at_the_frames(tmp_path):
    sys.path.insert(0, str(HERE.parent / "helpers" / "plugins"))
    import synthetic
    from calmotion.model.table import columns

    result, errors = synthetic.result(), loaded("error_table")
    table, file = columns(synthetic.character(), result), tmp_path / "errors.csv"
    lines = [",".join(f"{values[k]:.12g}" for values in table.values()) for k in range(len(table["time_s"]))]
    file.write_text("\n".join([",".join(table), *lines]) + "\n")
    times = [0.0, 0.123, 1.0, 9.0]
    (target,) = errors.read_errors(file, times)
    assert target.name == "Target"
    for simulation, error, places in (
        (result.before, target.error_before, target.before), (result.after, target.error_after, target.after)
    ):  # fmt: skip
        rows = simulation.motion.judged
        found = np.interp(times, simulation.motion.times[rows], simulation.position_errors[rows, 0])
        np.testing.assert_allclose(error, found, atol=1e-4 * found.max())
        path = [np.interp(times, simulation.motion.times, x) for x in simulation.motion.target_positions[:, 0].T]
        np.testing.assert_allclose(places, np.transpose(path), atol=1e-4)
    farthest = errors.largest([target])
    assert farthest == (list(target.error_before), list(target.error_after)) and max(farthest[0]) > 1e-3
    file.write_text("time_s,/a.error\n0,1\n")
    with pytest.raises(ValueError, match="no column /a.x_before"):
        errors.read_errors(file, times)


def test_progress_and_the_report_are_read(pipeline, tmp_path):
    command = script(tmp_path, """
print("note: für etwas", file=sys.stderr)
print("progress\\tMesh\\t0.5\\tlink 3", file=sys.stderr, flush=True)
print(json.dumps({"max_error_after_m": 0.001}))
""")  # fmt: skip
    run = pipeline.PipelineRun(job(pipeline, command, tmp_path)).start()
    run.wait(600.0)
    assert run.outcome == "done" and run.fraction == 1.0 and run.report == {"max_error_after_m": 0.001}


def test_errors_are_told_with_place_and_remedy(pipeline, tmp_path):
    command = script(tmp_path, """
print(json.dumps({"errors": [{"path": "/a", "attribute": "b", "problem": "is wrong", "remedy": "Mend it"}]}))
sys.exit(1)
""")  # fmt: skip
    run = pipeline.PipelineRun(job(pipeline, command, tmp_path)).start()
    run.wait(600.0)
    assert run.outcome == "failed" and run.errors == ["/a.b: is wrong. Mend it"]


def test_a_program_that_ends_without_a_message_is_reported(pipeline, tmp_path):
    run = pipeline.PipelineRun(job(pipeline, script(tmp_path, "sys.exit(3)"), tmp_path)).start()
    run.wait(600.0)
    assert run.outcome == "failed" and "status 3" in run.errors[0]
    run = pipeline.PipelineRun(job(pipeline, ["/no/such/program"], tmp_path)).start()
    run.wait(600.0)
    assert run.outcome == "failed" and "cannot be started" in run.errors[0]


def test_cancelling_stops_the_program(pipeline, tmp_path):
    command = script(tmp_path, "print('progress\\t\\t0.1\\t', file=sys.stderr, flush=True)\ntime.sleep(600)\n")
    run = pipeline.PipelineRun(job(pipeline, command, tmp_path)).start()
    end = time.monotonic() + 600.0
    while run.fraction == 0.0 and time.monotonic() < end:
        time.sleep(0.05)
    run.cancel()
    run.wait(600.0)
    assert run.outcome == "cancelled" and not run.running


def test_the_real_program_reports_its_progress(pipeline, repository, tmp_path, monkeypatch):
    sys.path.insert(0, str(HERE.parent / "helpers" / "usd"))
    import small_shots

    shot = small_shots.write_arm(tmp_path / "robot.usda", small_shots.make_flexible)
    (tmp_path / "shot.usda").write_text(shot.read_text())
    monkeypatch.setenv("PYTHONPATH", str(repository / "pipeline"))
    program = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(repository / 'pipeline')!r}); "
               "from calmotion.cli.main import main; sys.exit(main())"]  # fmt: skip
    (_, optimize) = job(pipeline, program, tmp_path).commands
    run = pipeline.PipelineRun(pipeline.Job((optimize,), tmp_path / "calm_root.usda", tmp_path / "errors.csv")).start()
    seen = set()
    while run.running:
        seen.add(run.message)
        time.sleep(0.01)
    assert run.outcome == "done", run.errors
    assert run.report["targets"] and len(seen) > 2 and (tmp_path / "calm_root.usda").is_file()


def blender(*arguments: object, **variables: str) -> str:
    done = subprocess.run(
        [BLENDER, *map(str, arguments)], env=os.environ | variables, capture_output=True, text=True, timeout=900
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def validator() -> Path:
    """Blender's own validator and builder of extensions."""
    printed = blender("-c", "import bpy; print(bpy.utils.system_resource('SCRIPTS'))")
    return Path(printed.strip().splitlines()[-1]) / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"


@needs_blender
def test_the_whole_way_there_and_back(tmp_path):
    from calmotion.usd.reading.skeletons import bound_skeletons
    from pxr import Usd

    printed = blender(
        HERE / "in_blender.py", EXTENSION, tmp_path, "-", CALMOTION_COMMAND=f"{sys.executable} -m calmotion"
    )
    assert "all is well" in printed
    # what Blender exports of the new action is what the optimised layer says
    stages = [Usd.Stage.Open(str(tmp_path / name)) for name in ("optimised_root.usda", "work/again.usda")]
    (meant,), (back,) = (bound_skeletons(stage) for stage in stages)
    for code in range(1, 26):
        assert np.abs(meant.locals_at(float(code)) - back.locals_at(float(code))).max() < 2e-5


@needs_blender
def test_robots_of_parented_objects_move_as_the_result_says(tmp_path):
    from pxr import Usd, UsdGeom

    printed = blender(
        HERE / "parts_in_blender.py", EXTENSION, tmp_path, CALMOTION_COMMAND=f"{sys.executable} -m calmotion"
    )
    if "no USD" in printed:
        pytest.skip("this module of Blender has no USD for Python")
    assert "all is well" in printed
    for kind in ("objects", "bones", "constraint"):
        folder = tmp_path / kind / "scene_calmotion"
        worlds = json.loads((tmp_path / kind / "worlds.json").read_text())
        shot, root = (Usd.Stage.Open(str(folder / name)) for name in ("shot.usda", "calm_root.usda"))
        prims = {prim.GetName(): prim for prim in shot.Traverse() if prim.GetTypeName() == "Xform"}
        moved = 0.0
        for name in ("Base", "Table", "Upper Arm", "Fore.L", "Bracket"):
            path = prims[re.sub(r"\W", "_", name)].GetPath()
            for code, world in enumerate(worlds[name], start=1):
                before, after = (
                    np.array(UsdGeom.XformCache(code).GetLocalToWorldTransform(stage.GetPrimAtPath(path))).T
                    for stage in (shot, root)
                )
                assert np.abs(after - world).max() < 1e-5, (kind, name, code)
                moved = max(moved, np.abs(after - before).max())
        assert moved > 1e-3, kind


@needs_blender
def test_blender_accepts_and_installs_the_package(tmp_path):
    extension = validator()
    blender(extension, "validate", EXTENSION)
    blender(extension, "build", "--source-dir", EXTENSION, "--output-dir", tmp_path)
    (archive,) = tmp_path.glob("*.zip")
    blender(extension, "validate", archive)
    assert {"blender_manifest.toml", "__init__.py", "LICENSE"} <= set(zipfile.ZipFile(archive).namelist())
    user = tmp_path / "user"
    printed = blender(HERE / "in_blender.py", EXTENSION, tmp_path, archive, BLENDER_USER_RESOURCES=str(user))
    assert "all is well" in printed


@needs_blender
@pytest.mark.long
def test_the_commands_of_the_page_optimise_what_blender_exports(repository, tmp_path):
    page = (repository / "docs" / "tutorials" / "blender.md").read_text()
    commands = re.findall(r"^ {4}calmotion (.*)$", page, re.MULTILINE)
    assert [line.split()[0] for line in commands] == ["rig", "optimize"]
    blender(HERE / "by_hand.py", EXTENSION, tmp_path, "export")
    for line in commands:
        done = subprocess.run(
            [sys.executable, "-m", "calmotion", *shlex.split(line)], cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stdout + done.stderr
    before, after = map(float, re.search(r"falls from ([\d.]+) mm to ([\d.]+) mm", done.stdout).groups())
    assert after < 0.2 * before
    printed = blender(HERE / "by_hand.py", EXTENSION, tmp_path, "import")
    assert 1e-4 < float(printed.split("largest change:")[1].split()[0]) < 0.2
