"""The report of a batch: outcomes, errors and problems of each job."""

from calmotion_plugins.shows.batch.jobs import jobs_for
from calmotion_plugins.shows.batch.report import DIED, DONE, FAILED, KEPT, BatchResult, JobResult


def results():
    jobs = jobs_for(["a.usda", "b.usda", "c.usda", "d.usda"], "out", "optimize")
    targets = [
        {"max_error_before_m": 0.06, "max_error_after_m": 0.001},
        {"max_error_before_m": 0.01, "max_error_after_m": 0.004},
    ]
    report = {"targets": targets, "tolerance_kept": True, "improved": True, "root_layer": "r.usda"}
    problem = {"problem": "no bodies", "path": "/Robot", "attribute": "a", "found": "none", "remedy": "Add one"}
    return [
        JobResult(jobs[0], DONE, 1, 10.0, report=report), JobResult(jobs[1], KEPT, report=report | {"improved": False}),
        JobResult(jobs[2], FAILED, 1, 2.0, problem), JobResult(jobs[3], DIED, 3, 2.0, {"problem": "signal 9"}),
    ]  # fmt: skip


def test_the_object_has_the_keys_of_the_contract_and_the_largest_errors():
    report = BatchResult("out", "optimize", "local", results(), 9.0).report()
    assert report["outcomes"] == {"done": 1, "kept": 1, "failed": 1, "died": 1} and report["jobs_wall_s"] == 10.0
    first, _, failed, died = report["jobs"]
    assert {"shot", "outcome", "attempts", "wall_s", "layer", "problem"} <= set(first)
    assert first["max_error_before_m"] == 0.06 and first["max_error_after_m"] == 0.004
    assert not BatchResult("out", "optimize", "local", results(), 9.0).successful
    assert failed["layer"] is None and failed["problem"]["path"] == "/Robot" and died["attempts"] == 3
