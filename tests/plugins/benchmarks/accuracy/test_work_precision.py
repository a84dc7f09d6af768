"""Error against run time: references that are converged, errors that fall as settings are finer, and the front."""

import csv
import json

import pytest
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion.tolerance.step_error import distance
from calmotion_plugins.benchmarks.accuracy import reference_bench, work_precision, work_precision_points
from calmotion_plugins.benchmarks.accuracy.reference_bench import Bench
from calmotion_plugins.benchmarks.accuracy.work_precision_points import forward_points
from calmotion_plugins.benchmarks.common.shots import Unreduced


@pytest.fixture(scope="module")
def bench():
    character, meshes = beam_arm(payload=0.1, damping=0.02)
    shot = Unreduced("arm", character, shot_of(quintic(0.8, 0.35, 0.1), 0.75), meshes)
    return Bench(shot, repeats=1)


@pytest.fixture(scope="module")
def reference(bench):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference_bench, "REFERENCE_STEP", 1 / 1920)
        return bench.reference(1e-6)


@pytest.fixture(scope="module")
def points(bench, reference):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(work_precision_points, "STEPS", (1 / 60, 1 / 120, 1 / 240, 1 / 480))
        patch.setattr(work_precision_points, "FINER_STEPS", (1 / 960,))
        patch.setattr(work_precision_points, "RADAU_STEPS", (1 / 60,))
        patch.setattr(work_precision_points, "MODES", (2, 8))
        patch.setattr(work_precision_points, "LEVELS", (5e-6,))
        patch.setattr(work_precision_points, "DIRECTIONS", (1e-4,))
        patch.setattr(work_precision_points, "REDUCTIONS", (1e-2, 1e-4))
        patch.setattr(work_precision_points, "BASE", 1e-4)
        patch.setattr(work_precision_points, "CUBATURE", 1e-4)
        return forward_points(bench, reference)


def of(points, series):
    return [point for point in points if point.series == series]


@pytest.mark.long
def test_the_error_bar_of_the_reference_covers_a_finer_one(bench, reference):
    finer = bench.run(bench.bodies(1e-7), 1 / 7680)
    assert distance(finer.positions, reference.positions) < 1.5 * reference.bar_m < 2e-4


def test_smaller_steps_are_nearer(points):
    steps = of(points, "bdf2")
    errors = [point.error_m for point in steps]
    assert errors == sorted(errors, reverse=True) and errors[0] > 10.0 * errors[-1]
    assert all(point.wall_s > 0.0 for point in steps)
    assert of(points, "radau")[0].error_m < 0.2 * errors[0]


def test_a_linear_arm_is_farther_off_than_a_nonlinear_one(points):
    law = {point.setting: point.error_m for point in of(points, "law")}
    assert law["stvk"] < 0.5 * law["linear"] and abs(law["neohookean"] - law["stvk"]) < 0.2 * law["linear"]


def test_the_command_writes_a_table_a_picture_and_one_object(bench, reference, points, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(work_precision, "load_unreduced", lambda path: bench.shot)
    monkeypatch.setattr(Bench, "reference", lambda self: reference)
    monkeypatch.setattr(work_precision_points, "forward_points", lambda bench, reference: points)
    monkeypatch.setattr(work_precision_points, "chosen_points", lambda bench, reference: [])
    table = tmp_path / "points.csv"
    assert work_precision.main(["arm.usda", "--json", "--csv", str(table), "--figures", str(tmp_path)]) == 0
    report = json.loads(capsys.readouterr().out)
    assert len(report["points"]) == len(points) and report["reference_error_m"] == {"arm": reference.bar_m}
    assert report["machine"]["cores"] >= 1
    with open(table, newline="") as file:
        assert [float(row["error_m"]) for row in csv.DictReader(file)] == [point.error_m for point in points]
    (figure,) = report["figures"]
    assert (tmp_path / "work_precision_arm.png").samefile(figure)
