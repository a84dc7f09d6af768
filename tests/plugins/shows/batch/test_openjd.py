"""Templates of Open Job Description: valid, and run by `openjd` with the files that a batch makes."""

import os
import re
import subprocess
import sys

import pytest
import yaml
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion_plugins.shows.batch.jobs import jobs_for
from calmotion_plugins.shows.batch.openjd import MOST_TASKS, openjd_template, write_template
from one_hinge import ONE_HINGE


def test_each_shot_is_a_task_with_the_line_of_its_job(tmp_path):
    jobs = jobs_for(["/a/one.usda", "/a/two.usda"], "/out", "optimize", ["--tolerance=0.001m"], ["csv"])
    template = openjd_template(jobs)
    (step,) = template["steps"]
    shot, name = step["parameterSpace"]["taskParameterDefinitions"]
    assert shot["range"] == ["/a/one.usda", "/a/two.usda"] and name["range"] == ["one", "two"]
    values = {"Task.Param.Shot": "/a/two.usda", "Task.Param.Name": "two", "Param.OutputFolder": "/out"}
    args = [re.sub(r"\{\{([\w.]+)\}\}", lambda m: values[m[1]], a) for a in step["script"]["actions"]["onRun"]["args"]]
    line = [text for text in jobs[1].line if text not in ("--json", "--quiet")]
    assert args == [*line, "--openjd"]
    kinds = [openjd_template(jobs, folder)["parameterDefinitions"][0] for folder in ("/out/farm", "/")]
    assert [(kind["type"], kind["default"]) for kind in kinds] == [("STRING", "/out"), ("PATH", "out")]


def test_templates_are_valid_also_of_thousands_of_shots():
    model = pytest.importorskip("openjd.model")
    jobs = jobs_for([f"/a/shot{k}.usda" for k in range(MOST_TASKS + 2)], "/out", "simulate")
    template = openjd_template(jobs)
    model.decode_job_template(template=template)
    assert [len(step["parameterSpace"]["taskParameterDefinitions"][0]["range"]) for step in template["steps"]] == [
        MOST_TASKS, 2,
    ]  # fmt: skip


@pytest.mark.parametrize("shot", ["/a/{{Param.X}}.usda", "/a/line\nend.usda"])
def test_text_that_a_template_cannot_hold_is_refused(shot):
    with pytest.raises(ShotError, match="cannot hold"):
        openjd_template(jobs_for([shot], "/out", "optimize"))


@pytest.mark.parametrize(
    ("template", "folder"), [("shot.usda", "out"), ("out", "out"), ("job", "o"), ("a.yaml", "a.yaml")]
)
def test_a_template_is_written_over_nothing_else(tmp_path, template, folder):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    jobs = jobs_for([tmp_path / "shot.usda"], tmp_path / folder, "optimize")
    with pytest.raises(SettingError, match="template"):
        write_template(tmp_path / template, jobs)
    assert [path.name for path in tmp_path.iterdir()] == ["shot.usda"]
    assert (tmp_path / "shot.usda").read_text() == ONE_HINGE


def test_a_template_is_run_by_openjd_with_progress_in_its_words(tmp_path, calmotion, repository):
    pytest.importorskip("openjd.cli")
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    template, folder = tmp_path / "job.yaml", tmp_path / "out"
    run = calmotion(
        "submit", tmp_path / "shot.usda", "--openjd", template, "-o", folder, "--step", "10ms", "--tolerance", "1mm"
    )
    assert run.returncode == 0 and "1 tasks" in run.stdout and yaml.safe_load(template.read_text())["name"]
    program = tmp_path / "program"
    program.write_text(f'#!/bin/sh\nPYTHONPATH="{repository / "pipeline"}" exec "{sys.executable}" -m calmotion "$@"\n')
    program.chmod(0o755)
    line = [sys.executable, "-m", "openjd", "run", str(template), "-p", f"Calmotion={program}", "--verbose"]
    done = subprocess.run(line, capture_output=True, text=True, timeout=600, env=dict(os.environ))
    assert done.returncode == 0, done.stdout + done.stderr
    progress = [float(found) for found in re.findall(r"openjd_progress: ([\d.]+)", done.stdout)]
    assert progress == sorted(progress) and progress[-1] == 100.0 and len(progress) > 3
    assert "openjd_status: Read the shot" in done.stdout
    alone = tmp_path / "alone.usda"
    run = calmotion("optimize", tmp_path / "shot.usda", "-o", alone, "--step", "0.01s", "--tolerance", "1mm")
    assert run.returncode == 0
    assert (folder / "shot_calm.usda").read_bytes() == alone.read_bytes()
    assert (folder / "shot_calm.manifest.json").exists()


def test_a_template_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ShotError, match="cannot be written"):
        write_template(tmp_path / "file" / "job.yaml", jobs_for(["/a.usda"], "/out", "simulate"))
