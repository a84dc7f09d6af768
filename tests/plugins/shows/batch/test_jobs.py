"""Jobs of a batch: distinct names, the command line of each, and whether it is done."""

import json
import os
from pathlib import Path

import pytest
from calmotion.cli.main import build_parser
from calmotion.errors import ShotError
from calmotion.support.files import write_text
from calmotion.workflow.manifest import FORMAT, sha256_of
from calmotion_plugins.shows.batch.jobs import Job, forget, is_done, jobs_for, mark_done


def test_files_of_shots_with_the_same_name_are_told_apart_by_their_folders():
    jobs = jobs_for(["/a/one/shot.usda", "/a/two/shot.usda", "/a/two/other.usda"], "/out", "optimize")
    assert [job.name for job in jobs] == ["one_shot", "two_shot", "two_other"]
    assert jobs[0].layer == "/out/one_shot_calm.usda" and jobs[0].manifest == "/out/one_shot_calm.manifest.json"
    same = jobs_for(["/a/shot.usda", "/a/shot.usdc"], "/out", "optimize")
    assert len({job.name for job in same}) == 2


def test_the_line_of_a_job_is_one_that_the_program_accepts():
    (job,) = jobs_for(["shot.usda"], "out", "optimize", ["--tolerance=0.001m", "--keep=modes"], ["csv", "figures"])
    args = build_parser().parse_args(job.line)
    assert args.shot == os.path.abspath("shot.usda") and args.tolerance == 0.001 and args.keep == ["modes"]
    assert args.csv == f"{job.stem}.csv" and args.figures == f"{job.stem}_figures" and args.manifest == job.manifest
    (job,) = jobs_for(["shot.usda"], "out", "simulate")
    assert build_parser().parse_args(job.line).output is None and job.layer is None


@pytest.mark.parametrize(
    ("shots", "command", "problem"),
    [
        ([], "optimize", "no shots"),
        (["a.usda", "./a.usda"], "optimize", "named twice"),
        (["a.usda"], "rig", "cannot run this command"),
        (["out/a.usda", "out/a_calm.usda"], "optimize", "written over a shot"),
    ],
)
def test_a_batch_that_cannot_be_is_refused(shots, command, problem):
    with pytest.raises(ShotError, match=problem):
        jobs_for(shots, "out", command)


def finished(folder: Path) -> Job:
    """A job whose files are there."""
    (folder / "shot.usda").write_text("shot")
    (job,) = jobs_for([folder / "shot.usda"], folder / "out", "optimize")
    write_text(job.layer, "layer")
    rows = [{"path": "../shot.usda", "sha256": sha256_of(job.shot), "role": "shot"}]
    outputs = [{"path": "shot_calm.usda", "sha256": sha256_of(job.layer), "role": "layer"}]
    manifest = {"format": FORMAT, "command": "optimize", "shot": "../shot.usda", "inputs": rows, "outputs": outputs}
    write_text(job.manifest, json.dumps(manifest | {"verdict": {}, "versions": {}}))
    mark_done(job)
    return job


def test_a_job_is_done_while_inputs_outputs_and_request_are_the_same(tmp_path):
    job = finished(tmp_path)
    assert is_done(job)
    (other,) = jobs_for([job.shot], job.folder, "optimize", ["--tolerance=0.001m"])
    assert not is_done(other)


@pytest.mark.parametrize("change", ["shot", "layer", "no layer", "manifest", "mark", "forgotten"])
def test_a_job_is_not_done_once_anything_has_changed(tmp_path, change):
    job = finished(tmp_path)
    if change == "shot":
        Path(job.shot).write_text("another")
    elif change == "layer":
        Path(job.layer).write_text("another")
    elif change == "no layer":
        os.unlink(job.layer)
    elif change == "manifest":
        Path(job.manifest).write_text("{}")
    elif change == "mark":
        next(Path(job.folder).glob("logs/*.done.json")).write_text("{")
    else:
        forget(job)
    assert not is_done(job)
