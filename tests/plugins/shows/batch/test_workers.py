"""Where jobs run: what a text names, what is missing, and calls that are lost, refused, or fail."""

import os
import sys
from collections import deque
from concurrent.futures import Executor, Future

import pytest
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion_plugins.shows.batch.workers import executor_on, finished, result_of


@pytest.mark.posix
def test_threads_of_this_machine_share_its_processors():
    with executor_on("local", 2) as (executor, limit):
        assert isinstance(executor, Executor) and limit == 2
        if hasattr(os, "sched_getaffinity") and len(os.sched_getaffinity(0)) > 1:
            shares = [executor.submit(_share).result() for _ in range(20)]
            assert all(0 < len(share) < len(os.sched_getaffinity(0)) for share in shares)


def _share():
    return os.sched_getaffinity(0)


@pytest.mark.parametrize("text", ["cloud", "dask", "dask://", "ssh://host"])
def test_a_place_that_is_not_known_is_refused(text):
    with pytest.raises(SettingError, match="--on"), executor_on(text, None):
        pass


@pytest.mark.parametrize("text", ["slurm", "slurm?slurm_partition=cpu"])
def test_slurm_is_reached_through_dask(text):
    with pytest.raises(SettingError, match=r"SLURMCluster of dask-jobqueue.*dask://HOST:PORT"), executor_on(text, None):
        pass


def test_a_missing_library_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ShotError, match=r"pip install distributed"), executor_on("dask://localhost:1", None):
        pass


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    distributed = pytest.importorskip("distributed")

    def silent(address, **options):
        raise TimeoutError("timed out")

    monkeypatch.setattr(distributed, "Client", silent)
    with pytest.raises(ShotError, match="does not answer") as refused, executor_on("dask://localhost:1", None):
        pass
    assert refused.value.path == "dask://localhost:1" and refused.value.found == "timed out"


class AtOnce(Executor):
    """Calls that run at once; it counts those that are under way."""

    def __init__(self):
        self.most = self.begun = 0

    def submit(self, function, *arguments):
        self.begun += 1
        future = Future()
        future.set_result(function(*arguments))
        return future


def test_calls_may_be_added_while_others_run_and_no_more_run_at_once_than_allowed():
    executor, calls, seen = AtOnce(), deque([(divmod, 7, 2), (divmod, 9, 4), (divmod, 5, 5)]), []
    for ended in finished(executor, calls, 2):
        if ended is None:
            assert executor.begun <= len(seen) + 2
            continue
        call, future = ended
        seen.append(future.result())
        if call == (divmod, 7, 2):
            calls.append((divmod, 1, 1))
    assert sorted(seen) == [(1, 0), (1, 0), (2, 1), (3, 1)]


def test_what_is_lost_has_a_reason():
    lost, gone = Future(), Future()
    lost.set_exception(OSError("the node is gone"))
    gone.cancel()
    gone.set_running_or_notify_cancel()
    assert "OSError: the node is gone" in result_of(lost).reason and "scheduler" in result_of(gone).reason
