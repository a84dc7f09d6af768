"""One attempt at a job: its outcome, and a process that does not outlive its worker."""

import json
import os
import subprocess
import sys

import pytest
from calmotion_plugins.shows.batch import child
from calmotion_plugins.shows.batch.attempt import _judged
from calmotion_plugins.shows.batch.jobs import jobs_for
from calmotion_plugins.shows.batch.report import DIED, DONE, FAILED


@pytest.fixture
def job(tmp_path):
    (job,) = jobs_for([tmp_path / "shot.usda"], tmp_path, "simulate")
    os.makedirs(os.path.dirname(job.log))
    return job


ERROR = {"problem": "no bodies", "path": "/Robot", "attribute": "", "found": "", "remedy": "Add one"}


@pytest.mark.parametrize(
    ("status", "printed", "outcome", "problem"),
    [
        (0, {"targets": []}, DONE, None),
        (1, {"error": ERROR, "errors": [ERROR]}, FAILED, "no bodies"),
        (2, {"error": ERROR, "errors": [ERROR]}, FAILED, "no bodies"),
        (2, None, FAILED, "an argument of the command does not fit"),
        (1, {"tolerance_kept": False}, FAILED, "the simulation does not keep the tolerance"),
        (1, {"tolerance_kept": True, "improved": False}, FAILED, "the curves leave a larger error than the animation"),
        (-9, None, DIED, "the process ended by signal 9"),
        (137, None, DIED, "the process ended with status 137"),
        (130, {"interrupted": True}, DIED, "the process was asked to end"),
        (0, None, DIED, "the process ended with status 0"),
    ],
)
def test_a_process_that_refuses_has_failed_and_one_that_ends_otherwise_has_died(job, status, printed, outcome, problem):
    found, why, report = _judged(job, status, "" if printed is None else json.dumps(printed))
    assert found == outcome
    assert (why or {}).get("problem") == problem
    assert report == (printed if outcome != DIED else None)


def test_a_process_ends_with_the_worker_that_holds_its_input():
    code = f"import time\nfrom {child.__name__} import *\nfrom {child.__name__} import _end_with_worker\n"
    code += "threading.Thread(target=_end_with_worker, args=(0,), daemon=True).start()\nprint('on', flush=True)\n"
    process = subprocess.Popen(
        [sys.executable, "-c", f"{code}time.sleep(600)"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "on\n" and process.poll() is None
    process.stdin.close()
    assert process.wait(timeout=600) == child.ORPHANED
    process.stdout.close()
