"""Tolerances of the optimisation, measured: they are kept, and one that is not is told."""

import pytest
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion_plugins.benchmarks.accuracy import reference_bench
from calmotion_plugins.benchmarks.accuracy.tolerances import Tolerances
from calmotion_plugins.benchmarks.common.shots import Unreduced


@pytest.fixture(scope="module")
def shot():
    character, meshes = beam_arm(payload=0.1, damping=0.02)
    return Unreduced("arm", character, shot_of(quintic(0.8, 0.35, 0.1), 0.75), meshes)


@pytest.fixture(scope="module")
def rows(shot):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference_bench, "REFERENCE_STEP", 1 / 1920)
        return [Tolerances(shot, nodes=1.0).kept(tolerance, "optimize") for tolerance in (1e-2, 1e-3)]


def test_simulations_keep_their_tolerance(shot):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference_bench, "REFERENCE_STEP", 1 / 1920)
        measured = Tolerances(shot, nodes=1.0)
        measured.warm(1e-2, "simulate")
        found = [measured.kept(tolerance) for tolerance in (1e-2, 1e-3, 1e-4)]
    assert all(row.kept and row.reference_m < 0.1 * row.tolerance_m for row in found)
    assert found[2].step_s < found[0].step_s
    assert found[0].shake_after_m == found[0].shake_before_m


def test_results_keep_their_tolerance(rows):
    for row, tolerance in zip(rows, (1e-2, 1e-3), strict=True):
        assert row.kept and row.error_m <= row.tolerance_m == tolerance
        assert row.shake_after_m < 0.2 * row.shake_before_m
    assert rows[1].coordinates >= rows[0].coordinates


def test_a_reference_with_finer_meshes_knows_how_far_its_reduction_may_be_off(shot):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reference_bench, "REFERENCE_STEP", 1 / 960)
        bench = reference_bench.Bench(shot, nodes=2.0)
        rough, fine = (bench.reference(finest) for finest in (1e-3, 1e-5))
    assert len(bench.shot.meshes.meshes[0].tets) > len(shot.meshes.meshes[0].tets)
    assert fine.bar_m < rough.bar_m
    assert reference_bench.distance(rough.positions, fine.positions) < rough.bar_m
