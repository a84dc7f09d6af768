"""Searches that are cut off go on where they were, and files of other problems are not taken."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.retargeting import checkpoint, search
from calmotion.retargeting.checkpoint import checkpoint_path, problem_key
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.problem import adaptive_knots
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.support.caching.verified_files import read_arrays, write_arrays
from posed import ignore_progress, jerking, make_problem

OPTIONS = RunSettings(step=1 / 120)


@pytest.fixture(scope="module")
def limited(arm):
    """The arm with limits that bind, so that the search has all its parts."""
    motors = tuple(dataclasses.replace(motor, max_velocity=3.2) for motor in arm.motors)
    return dataclasses.replace(arm, motors=motors)


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A checkpoint of the whole search, once that is made."""
    return tmp_path_factory.mktemp("stored") / "kept.npz"


@pytest.fixture(scope="module", autouse=True)
def whole(limited, animation, bodies, stored):
    return optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, stored)


class Killed(Exception):
    pass


def stopping(monkeypatch, evaluations, error):
    """Make the problem raise at its n-th evaluation."""
    calls, at = [0], RetargetProblem.at

    def counted(self, x, near=None):
        calls[0] += 1
        if calls[0] == evaluations:
            raise error
        return at(self, x, near)

    monkeypatch.setattr(RetargetProblem, "at", counted)


def agree(again, whole):
    """Two searches end where less than the least gain is left, so not at the same bits."""
    assert again.objective_after == pytest.approx(whole.objective_after, rel=1e-2)
    assert again.objective_after < 0.1 * again.objective_before
    largest = max(np.abs(curve.frame_values - curve.frame_values[0]).max() for curve in whole.curves)
    for one, other in zip(again.curves, whole.curves, strict=True):
        assert np.abs(one.frame_values - other.frame_values).max() < 1e-3 * largest


@pytest.mark.parametrize("evaluations", [4, 5, 8])
def test_a_killed_search_ends_at_the_same_result(limited, animation, bodies, whole, tmp_path, monkeypatch, evaluations):
    path = tmp_path / "kept.npz"
    with monkeypatch.context() as patch:
        stopping(patch, evaluations, Killed())
        with pytest.raises(Killed):
            optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert path.exists() == (evaluations > 4)
    again = optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert (again.search.resumed_iterations > 0) == (evaluations > 4)
    agree(again, whole)
    assert [p.name for p in tmp_path.iterdir()] == ["kept.npz"], "no part of a file is left"


def test_a_search_that_was_killed_on_finer_knots_resumes_with_them(arm, bodies, tmp_path, monkeypatch):
    monkeypatch.setattr(adaptive_knots, "FIRST", 0.1)
    path = tmp_path / "kept.npz"
    direct = optimize_shot(compile_shot(arm, jerking(), bodies), OPTIONS, ignore_progress)
    with monkeypatch.context() as patch:
        stopping(patch, 7, Killed())
        with pytest.raises(Killed):
            optimize_shot(compile_shot(arm, jerking(), bodies), OPTIONS, ignore_progress, path)
    again = optimize_shot(compile_shot(arm, jerking(), bodies), OPTIONS, ignore_progress, path)
    assert again.search.resumed_iterations > 0 and again.objective_after < 0.1 * again.objective_before
    assert again.objective_after == pytest.approx(direct.objective_after, rel=1e-2)


def test_an_interrupt_keeps_the_best_so_far(limited, animation, bodies, whole, tmp_path, monkeypatch):
    path = tmp_path / "kept.npz"
    with monkeypatch.context() as patch:
        stopping(patch, 5, KeyboardInterrupt())
        early = optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert early.interrupted and early.search.stopped == "interrupted" and not whole.interrupted
    assert early.objective_before > early.objective_after
    assert any(curve.changed for curve in early.curves)
    late = optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert late.search.resumed_iterations > 0 and not late.interrupted
    agree(late, whole)


def test_a_checkpoint_of_another_problem_is_not_used(limited, animation, bodies, stored, tmp_path, monkeypatch):
    path = tmp_path / "kept.npz"
    path.write_bytes(stored.read_bytes())
    started = []
    find = search.minimize

    def watched(problem, begin, *arguments, **options):
        started.append(bool(np.any(begin.x)))
        return find(problem, begin, *arguments, **options)

    monkeypatch.setattr(search, "minimize", watched)
    other = dataclasses.replace(limited, gravity=0.9 * limited.gravity)
    optimize_shot(compile_shot(other, animation, bodies), OPTIONS, ignore_progress, path)
    first = started.copy()
    path.write_bytes(b"torn")
    started.clear()
    optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert started == first


def edited(path, **changes):
    """Change arrays of a checkpoint, as somebody does who knows the format."""
    values = read_arrays(path)
    write_arrays(path, values | {name: change(values[name]) for name, change in changes.items()})


FORGED = {
    "coefficients times 1000": {"x": lambda x: 1000.0 * x},
    "an objective that is too small": {"objective": lambda objective: 1e-6 * objective},
    "fewer coefficients": {"x": lambda x: x[:-1]},
    "other knots": {"breaks": lambda breaks: breaks[::-1].copy()},
    "knots of another shot": {"breaks": lambda breaks: 2 * breaks},
}
OF_ANOTHER_KIND = {
    "not a number": {"x": lambda x: np.full_like(x, np.nan)},
    "knots that are no numbers of frames": {"breaks": lambda breaks: breaks + 0.5},
    "complex coefficients": {"x": lambda x: x.astype(complex)},
    "coefficients of single precision": {"x": lambda x: x.astype(np.float32)},
    "coefficients of two axes": {"x": lambda x: x[:, None]},
    "coefficients of text": {"x": lambda x: x.astype(str)},
    "one coefficient": {"x": lambda x: x[0]},
    "no knots": {"breaks": lambda breaks: breaks[:0]},
    "knots of two axes": {"breaks": lambda breaks: breaks[None]},
    "an objective of text": {"objective": lambda objective: objective.astype(str)},
    "half an iteration": {"iterations": lambda count: count + 0.5},
    "fewer iterations than none": {"iterations": lambda count: -count},
}


@pytest.mark.parametrize("how", FORGED)
def test_a_forged_checkpoint_is_refused_with_a_warning(
    limited, animation, bodies, whole, stored, tmp_path, caplog, how
):
    path = tmp_path / "kept.npz"
    path.write_bytes(stored.read_bytes())
    edited(path, **FORGED[how])
    again = optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert len(caplog.messages) == 1 and str(path) in caplog.messages[0] and "begins anew" in caplog.messages[0]
    assert again.objective_after == pytest.approx(whole.objective_after, rel=1e-9)
    assert again.search.iterations == whole.search.iterations


@pytest.mark.parametrize("how", OF_ANOTHER_KIND)
def test_a_file_of_values_of_another_kind_is_refused_with_a_warning(stored, tmp_path, caplog, how):
    path = tmp_path / "kept.npz"
    path.write_bytes(stored.read_bytes())
    kept = checkpoint.Checkpoint(path, read_arrays(path)["key"].tobytes().decode())
    assert kept.load() is not None
    edited(path, **OF_ANOTHER_KIND[how])
    assert kept.load() is None and len(caplog.messages) == 1 and "is not usable" in caplog.messages[0]


def test_a_damaged_checkpoint_is_refused_at_any_byte(stored, tmp_path, caplog):
    whole = stored.read_bytes()
    path = tmp_path / "kept.npz"
    kept = checkpoint.Checkpoint(path, "key")
    damaged = [whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :] for at in range(0, len(whole), 997)]
    damaged += [b"", whole[:100], b"\x93NUMPY", b"PK", bytes(1000)]
    for content in damaged:
        path.write_bytes(content)
        assert kept.load() is None
    assert len(caplog.messages) == len(damaged) and all("is damaged" in message for message in caplog.messages)
    path.unlink()
    path.mkdir()
    assert kept.load() is None


def test_a_search_that_had_ended_goes_on_from_its_end(limited, animation, bodies, whole, stored, tmp_path, caplog):
    path, lines = tmp_path / "kept.npz", []
    path.write_bytes(stored.read_bytes())
    again = optimize_shot(
        compile_shot(limited, animation, bodies), OPTIONS, lambda done, text: lines.append(text), path
    )
    assert not caplog.messages and any("resuming after" in line for line in lines)
    assert again.search.iterations < whole.search.iterations
    assert 0 < again.search.resumed_iterations <= whole.search.iterations and whole.search.resumed_iterations == 0
    agree(again, whole)


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


def test_a_folder_in_place_of_the_file_stays_and_is_no_error(tmp_path):
    checkpoint.remove_checkpoint(tmp_path / "none.npz")
    (tmp_path / "kept.npz").mkdir()
    checkpoint.remove_checkpoint(tmp_path / "kept.npz")
    assert (tmp_path / "kept.npz").is_dir()
