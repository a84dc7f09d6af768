"""Searches that are cut off go on as if nothing had happened, and files of other problems are not taken."""

import dataclasses

import numpy as np
import pytest
from calmotion.retargeting import checkpoint, search
from calmotion.retargeting.checkpoint import checkpoint_path, problem_key
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem import adaptive_knots
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.shot.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from posed import ignore_progress, jerking, make_problem

OPTIONS = RunSettings(step=1 / 240)


@pytest.fixture(scope="module")
def limited(arm):
    """The arm with limits that bind, so that the search has all its parts."""
    motors = tuple(dataclasses.replace(motor, max_velocity=3.2) for motor in arm.motors)
    return dataclasses.replace(arm, motors=motors)


@pytest.fixture(scope="module")
def whole(limited, animation, bodies):
    return optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress)


class Killed(Exception):
    pass


def stopping(monkeypatch, evaluations, error):
    """Make the problem raise at its n-th evaluation."""
    calls, value = [0], RetargetProblem.value

    def counted(self, x):
        calls[0] += 1
        if calls[0] == evaluations:
            raise error
        return value(self, x)

    monkeypatch.setattr(RetargetProblem, "value", counted)


@pytest.mark.parametrize("evaluations", [1, 3, 4, 5, 7, 8])
def test_a_killed_search_ends_at_the_same_result(
    limited, animation, bodies, whole, tmp_path, monkeypatch, evaluations
):  # fmt: skip
    path = tmp_path / "kept.npz"
    with monkeypatch.context() as patch:
        stopping(patch, evaluations, Killed())
        with pytest.raises(Killed):
            optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert path.exists() == (evaluations > 3)
    again = optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert again.objective_after == pytest.approx(whole.objective_after, rel=1e-9)
    for one, other in zip(again.curves, whole.curves, strict=True):
        assert np.abs(one.frame_values - other.frame_values).max() < 1e-9
    assert [p.name for p in tmp_path.iterdir()] == ["kept.npz"], "no part of a file is left"


@pytest.mark.parametrize("evaluations", [5, 7, 9])
def test_a_search_that_was_killed_on_finer_knots_resumes_with_them(
    arm, bodies, tmp_path, monkeypatch, evaluations
):  # fmt: skip
    monkeypatch.setattr(adaptive_knots, "FIRST", 0.1)
    path = tmp_path / "kept.npz"
    direct = optimize_shot(compile_shot(arm, jerking(), bodies), OPTIONS, ignore_progress)
    with monkeypatch.context() as patch:
        stopping(patch, evaluations, Killed())
        with pytest.raises(Killed):
            optimize_shot(compile_shot(arm, jerking(), bodies), OPTIONS, ignore_progress, path)
    again = optimize_shot(compile_shot(arm, jerking(), bodies), OPTIONS, ignore_progress, path)
    assert again.parameters == direct.parameters
    assert again.objective_after == pytest.approx(direct.objective_after, rel=1e-9)
    for one, other in zip(again.curves, direct.curves, strict=True):
        assert np.abs(one.frame_values - other.frame_values).max() < 1e-9
        assert np.array_equal(one.knots, other.knots)


def test_an_interrupt_keeps_the_best_so_far(limited, animation, bodies, whole, tmp_path, monkeypatch):
    path = tmp_path / "kept.npz"
    with monkeypatch.context() as patch:
        stopping(patch, 4, KeyboardInterrupt())
        early = optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert early.interrupted and early.stopped == "interrupted" and not whole.interrupted
    assert early.objective_before > early.objective_after
    assert any(curve.changed for curve in early.curves)
    late = optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert late.objective_after == pytest.approx(whole.objective_after, rel=1e-9) and not late.interrupted


def test_a_checkpoint_of_another_problem_is_not_used(limited, animation, bodies, tmp_path, monkeypatch):
    path = tmp_path / "kept.npz"
    optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    started = []
    find = search.minimize

    def watched(problem, begin, *arguments, **options):
        started.append(len(begin.history))
        return find(problem, begin, *arguments, **options)

    monkeypatch.setattr(search, "minimize", watched)
    other = dataclasses.replace(limited, gravity=0.9 * limited.gravity)
    optimize_shot(compile_shot(other, animation, bodies), OPTIONS, ignore_progress, path)
    assert started[0] == 0
    path.write_bytes(b"torn")
    started.clear()
    optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert started[0] == 0


def test_the_key_depends_on_regularisation_and_code(arm, animation, bodies, monkeypatch):
    def key(smoothness):
        problem = make_problem(arm, bodies, animation, smoothness=smoothness)
        return problem_key(problem, np.zeros(problem.size, bool), OPTIONS)

    assert key(1e-6) == key(1e-6) != key(2e-6)
    before = key(1e-6)
    monkeypatch.setattr(checkpoint, "source_digest", lambda *rooms: "another version of the engine")
    assert key(1e-6) != before


def test_the_file_lies_hidden_beside_the_layer():
    path = checkpoint_path("/shots/arm_calm.usda")
    assert path.parent.name == "shots" and path.name.startswith(".") and "arm_calm.usda" in path.name
