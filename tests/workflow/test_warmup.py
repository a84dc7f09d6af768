"""Compiling ahead of the first shot."""

import json
import os
import threading

import calmotion as cm
import psutil
import pytest
from calmotion.errors import ShotError
from calmotion.support import compilation
from calmotion.support.compilation import compiling
from calmotion.workflow import warmup as module


def test_a_warm_installation_compiles_nothing_again_and_counts_its_kernels(calmotion, tmp_path, monkeypatch):
    assert cm.warmup().kernels > 100
    (tmp_path / "kept.nbc").touch()
    # other processes of the tests add kernels to the shared folder
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    first = cm.warmup()
    assert (first.kernels, first.compiled, first.folder) == (1, 0, str(tmp_path)) and first.wall_s > 0.0
    done = calmotion("warmup", "--json")
    again = json.loads(done.stdout)
    assert done.returncode == 0 and again["compiled"] == 0 and again["kernels"] == 1
    assert again["folder"] == first.folder
    assert calmotion("warmup").stdout.startswith("nothing to compile in ")


def test_kernels_that_cannot_be_kept_are_an_error(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "nothing is written here"))  # kernels are loaded already
    with pytest.raises(ShotError, match="cannot be kept") as error:
        module.warmup()
    assert "CALMOTION_CACHE" in str(error.value)


DIVIDED = {"newton.step", "so3.turn", "so3.turns_between", "so3.matrix_of", "regularized_statics.is_regularized"}


@pytest.mark.long
def test_a_search_compiles_after_it_what_only_divided_steps_need(calmotion_process, repository, tmp_path):
    cache = tmp_path / "cache"
    environment = os.environ | {"CALMOTION_CACHE": str(cache)}
    made = json.loads(calmotion_process("warmup", "--json", env=environment).stdout)
    assert made["compiled"] == made["kernels"] > 100
    before = set(cache.rglob("*.nbc"))
    shot = repository / "samples" / "bartender" / "bartender.usda"
    calmotion_process("optimize", shot, "-o", tmp_path / "calm.usda", env=environment)
    assert {path.name.split("-")[0] for path in set(cache.rglob("*.nbc")) - before} <= DIVIDED


@pytest.fixture
def shared():
    """Two processes compile, as the counts of this one see it."""
    compiling.processes = 2
    yield compiling
    compiling.processes = 1


def test_a_first_run_is_helped_by_another_process_which_ends_with_it(tmp_path, monkeypatch, shared):
    monkeypatch.setattr(module, "_folder", lambda: tmp_path)
    monkeypatch.setattr(module, "processors", lambda: [0, 1])
    told, before = [], set(psutil.Process().children())
    with module.first_run(told.append):
        (helper,) = set(psutil.Process().children()) - before
        assert helper.is_running()
    assert not helper.is_running()
    assert len(told) == 1 and "about 30 s" in told[0]
    (tmp_path / "kernel.1.nbc").touch()
    with module.first_run(told.append):
        assert set(psutil.Process().children()) == before
    assert len(told) == 1


def test_a_kernel_that_another_process_compiles_is_waited_for(tmp_path, monkeypatch, shared):
    monkeypatch.setattr(compilation, "cache_place", lambda: tmp_path)
    held, released, order = threading.Event(), threading.Event(), []

    def other():
        with shared.claimed("calmotion.kernel", ("float64",)):
            held.set()
            released.wait(10.0)
            order.append("other")

    thread = threading.Thread(target=other)
    thread.start()
    assert held.wait(10.0)
    with shared.claimed("calmotion.kernel", ("int64",)):  # of other types: another kernel
        pass
    threading.Timer(0.2, released.set).start()
    with shared.claimed("calmotion.kernel", ("float64",)):
        order.append("this")
    thread.join()
    assert order == ["other", "this"]
