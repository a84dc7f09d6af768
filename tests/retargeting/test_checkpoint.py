"""Searches that are cut off go on as if nothing had happened, and files of other problems are not taken."""

import dataclasses
import json

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
    calls, at = [0], RetargetProblem.at

    def counted(self, x, near=None):
        calls[0] += 1
        if calls[0] == evaluations:
            raise error
        return at(self, x, near)

    monkeypatch.setattr(RetargetProblem, "at", counted)


@pytest.mark.parametrize("evaluations", [1, 3, 4, 5, 7, 8])
def test_a_killed_search_ends_at_the_same_result(
    limited, animation, bodies, whole, tmp_path, monkeypatch, evaluations
):  # fmt: skip
    path = tmp_path / "kept.npz"
    with monkeypatch.context() as patch:
        stopping(patch, evaluations, Killed())
        with pytest.raises(Killed):
            optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert path.exists() == (evaluations > 4)
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
        stopping(patch, 5, KeyboardInterrupt())
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


def edited(path, **changes):
    """Change arrays of a checkpoint, or fields of its state, as somebody does who knows the format."""
    values = read_arrays(path)
    state = json.loads(values["state"].tobytes())
    for name, change in changes.items():
        if name in values:
            values[name] = change(values[name])
        else:
            state[name] = change
    values["state"] = np.frombuffer(json.dumps(state).encode(), np.uint8)
    write_arrays(path, values)


FORGED = {
    "coefficients times 1000": {"x": lambda x: 1000.0 * x},
    "coefficients times 1000, converged": {"x": lambda x: 1000.0 * x, "reason": "converged"},
    "a merit that is too small": {"merit": 1e-12},
    "not a number": {"x": lambda x: np.full_like(x, np.nan), "reason": "converged"},
    "directions that are not finite": {"Hp": lambda Hp: np.inf * Hp},
    "directions of another size": {"p": lambda p: p[:, :-1]},
    "fewer coefficients": {"x": lambda x: x[:-1], "p": lambda p: p[:, :-1], "Hp": lambda p: p[:, :-1]},
    "other knots": {"breaks": lambda breaks: breaks[::-1].copy()},
    "knots of another shot": {"breaks": lambda breaks: 2 * breaks},
    "knots that are no numbers of frames": {"breaks": lambda breaks: breaks + 0.5},
    "no history": {"history": lambda history: history[:, :2]},
    "multipliers of another size": {"limit velocity": lambda y: y[:, :-1]},
}


@pytest.fixture(scope="module")
def stored(limited, animation, bodies, tmp_path_factory):
    """A checkpoint of the whole search."""
    path = tmp_path_factory.mktemp("stored") / "kept.npz"
    optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    return path


@pytest.mark.parametrize("how", FORGED)
def test_a_forged_checkpoint_is_refused_with_a_warning(
    limited, animation, bodies, whole, stored, tmp_path, caplog, how
):  # fmt: skip
    path = tmp_path / "kept.npz"
    path.write_bytes(stored.read_bytes())
    edited(path, **FORGED[how])
    again = optimize_shot(compile_shot(limited, animation, bodies), OPTIONS, ignore_progress, path)
    assert len(caplog.messages) == 1 and str(path) in caplog.messages[0] and "begins anew" in caplog.messages[0]
    assert again.objective_after == pytest.approx(whole.objective_after, rel=1e-9)
    assert again.iterations == whole.iterations


KINDS = {
    "complex coefficients": {"x": lambda x: x.astype(complex)},
    "coefficients of single precision": {"x": lambda x: x.astype(np.float32)},
    "coefficients of two axes": {"x": lambda x: x[:, None]},
    "coefficients of text": {"x": lambda x: x.astype(str)},
    "one coefficient": {"x": lambda x: x[0]},
    "directions of one axis": {"p": lambda p: p.ravel(), "Hp": lambda Hp: Hp.ravel()},
    "no knots": {"breaks": lambda breaks: breaks[:0]},
    "knots of two axes": {"breaks": lambda breaks: breaks[None]},
    "a history of text": {"history": lambda history: history.astype(str)},
    "multipliers of text": {"limit velocity": lambda y: y.astype(str)},
    "a radius of text": {"radius": "wide"},
    "a negative radius": {"radius": -1.0},
    "a radius that is no number": {"radius": float("nan")},
    "a merit of text": {"merit": "good"},
    "half an evaluation": {"evaluations": 0.5},
    "fewer gradients than none": {"gradients": -1},
    "a reason that is a number": {"reason": 3},
    "a penalty that is no number": {"rho": None},
    "a switch of text": {"on": "yes"},
}


@pytest.mark.parametrize("how", KINDS)
def test_numbers_of_other_kinds_never_reach_a_kernel(limited, animation, bodies, stored, tmp_path, caplog, how):
    path = tmp_path / "kept.npz"
    path.write_bytes(stored.read_bytes())
    key = json.loads(read_arrays(path)["state"].tobytes())["key"]
    problem = make_problem(limited, bodies, animation, limited=True)
    kept = checkpoint.Checkpoint(path, key)
    assert kept.load(problem.limits) is not None
    edited(path, **KINDS[how])
    assert kept.load(problem.limits) is None and len(caplog.messages) == 1 and "not usable" in caplog.messages[0]


def test_a_damaged_checkpoint_is_refused_at_any_byte(limited, animation, bodies, stored, tmp_path, caplog):
    whole = stored.read_bytes()
    path = tmp_path / "kept.npz"
    problem = make_problem(limited, bodies, animation)
    kept = checkpoint.Checkpoint(path, "key")
    damaged = [whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :] for at in range(0, len(whole), 997)]
    damaged += [b"", whole[:100], b"\x93NUMPY", b"PK", bytes(1000)]
    for content in damaged:
        path.write_bytes(content)
        assert kept.load(problem.limits) is None
    assert len(caplog.messages) == len(damaged) and all("is damaged" in message for message in caplog.messages)
    path.unlink()
    path.mkdir()
    assert kept.load(problem.limits) is None


def test_a_stored_search_that_had_converged_is_not_repeated(limited, animation, bodies, whole, stored, caplog):
    lines = []
    again = optimize_shot(
        compile_shot(limited, animation, bodies), OPTIONS, lambda done, text: lines.append(text), stored
    )  # fmt: skip
    assert not caplog.messages and any("resuming after" in line for line in lines)
    assert again.iterations == whole.iterations
    assert 0 < again.resumed_iterations <= whole.iterations and whole.resumed_iterations == 0
    assert again.objective_after == pytest.approx(whole.objective_after, rel=1e-9)


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


@pytest.fixture(scope="module")
def begun(arm, animation, bodies, tmp_path_factory):
    """A search without limits, its result, and its checkpoint as if it had only begun: its point is the input."""
    path, shot = tmp_path_factory.mktemp("begun") / "kept.npz", compile_shot(arm, animation, bodies)
    whole = optimize_shot(shot, OPTIONS, ignore_progress, path)
    edited(path, x=np.zeros_like, history=lambda history: history[:1], merit=whole.steps[0].objective)
    return shot, whole, path.read_bytes()


NO_PAIRS = {"p": lambda p: p[:0], "Hp": lambda Hp: Hp[:0]}
CLAIMS = {
    "converged at the input": NO_PAIRS | {"reason": "converged"},
    "a reason that does not exist": NO_PAIRS | {"reason": "all is well"},
    "a trust region of nothing": NO_PAIRS | {"reason": "", "radius": 1e-30},
    "a trust region of nothing, and an end": NO_PAIRS | {"reason": "no further decrease", "radius": 0.0},
    "directions of another problem": {"reason": "", "Hp": lambda Hp: 1e9 * Hp},
    "directions without curvature": {"reason": "", "Hp": np.zeros_like},
    "directions of negative curvature": {"reason": "converged", "Hp": lambda Hp: -Hp},
}


@pytest.mark.parametrize("claim", CLAIMS)
def test_what_a_file_says_of_the_end_of_its_search_is_not_believed(begun, tmp_path, claim):
    """The point of the file and its merit are right; it is only not where the search would have ended."""
    shot, whole, content = begun
    path = tmp_path / "kept.npz"
    path.write_bytes(content)
    edited(path, **CLAIMS[claim])
    again = optimize_shot(shot, OPTIONS, ignore_progress, path)
    assert again.stopped in ("converged", "no further decrease")
    assert again.objective_after == pytest.approx(whole.objective_after, rel=1e-2)
    assert again.objective_after < 0.1 * again.objective_before


def test_a_folder_in_place_of_the_file_stays_and_is_no_error(tmp_path):
    checkpoint.remove_checkpoint(tmp_path / "none.npz")
    (tmp_path / "kept.npz").mkdir()
    checkpoint.remove_checkpoint(tmp_path / "kept.npz")
    assert (tmp_path / "kept.npz").is_dir()
