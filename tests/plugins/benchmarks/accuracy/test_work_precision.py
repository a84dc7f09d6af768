"""Error against run time: references that are converged, errors that fall as settings are finer, and the front."""

from dataclasses import replace

import pytest
from calmotion.model import FEMeshes
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion.tolerance.step_error import distance
from calmotion_plugins.benchmarks.accuracy import reference_bench, work_precision
from calmotion_plugins.benchmarks.accuracy.figure import draw_work_precision
from calmotion_plugins.benchmarks.accuracy.reference_bench import Bench
from calmotion_plugins.benchmarks.accuracy.work_precision import chosen_points, forward_points
from calmotion_plugins.benchmarks.common.shots import Unreduced


@pytest.fixture(scope="module")
def bench():
    character, meshes = beam_arm(payload=0.1, damping=0.02)
    rough = [replace(mesh, quality=replace(mesh.quality, frequency_error=0.02)) for mesh in meshes.meshes]
    shot = Unreduced("arm", character, shot_of(quintic(0.8, 0.35, 0.1), 0.75), FEMeshes(tuple(rough)))
    return Bench(shot, repeats=1)


@pytest.fixture(scope="module")
def reference(bench):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference_bench, "REFERENCE_STEP", 1 / 1920)
        return bench.reference(1e-6)


@pytest.fixture(scope="module")
def points(bench, reference):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(work_precision, "STEPS", (1 / 60, 1 / 120, 1 / 240, 1 / 480))
        patch.setattr(work_precision, "FINER_STEPS", (1 / 960,))
        patch.setattr(work_precision, "MODES", (2, 8))
        patch.setattr(work_precision, "LEVELS", (5e-6,))
        patch.setattr(work_precision, "DIRECTIONS", (1e-4,))
        patch.setattr(work_precision, "REDUCTIONS", (1e-2, 1e-4))
        patch.setattr(work_precision, "BASE", 1e-4)
        patch.setattr(work_precision, "CUBATURE", 1e-4)
        return forward_points(bench, reference)


def of(points, series):
    return [point for point in points if point.series == series]


@pytest.mark.long
def test_the_error_bar_of_the_reference_covers_a_finer_one(bench, reference):
    finer = bench.run(bench.bodies(1e-7), 1 / 7680)
    assert distance(finer.positions, reference.positions) < 1.5 * reference.bar_m < 2e-4


def test_choices_are_compared_on_the_meshes_of_the_reference(bench, reference):
    """On meshes that were refined for the tolerance they would differ by what the first meshes are wrong."""
    kept = [point for point in chosen_points(bench, reference, [1e-4, 3e-5]) if point.series == "tolerance"]
    assert [point.error_m < allowed for point, allowed in zip(kept, (1e-4, 3e-5), strict=True)] == [True, True]


def test_a_linear_arm_is_farther_off_than_a_nonlinear_one(points):
    law = {point.setting: point.error_m for point in of(points, "law")}
    assert law["stvk"] < 0.5 * law["linear"] and abs(law["neohookean"] - law["stvk"]) < 0.2 * law["linear"]


def test_a_run_that_failed_does_not_disturb_the_front():
    nan = float("nan")
    runs = [(0.3, 1.0), (nan, nan), (0.2, 3.0), (0.1, 2.0), (nan, nan), (0.4, 0.5), (0.05, 9.0)]
    found = reference_bench.front([reference_bench.Point("a", "b", "c", 0.1, 1, *run) for run in runs])
    assert [(p.wall_s, p.error_m) for p in found] == [(0.05, 9.0), (0.1, 2.0), (0.3, 1.0), (0.4, 0.5)]


def test_the_figure_has_all_points(points, tmp_path):
    assert draw_work_precision(str(tmp_path), points, 1e-5).endswith("work_precision_arm.png")
    assert (tmp_path / "work_precision_arm.png").stat().st_size > 10_000
