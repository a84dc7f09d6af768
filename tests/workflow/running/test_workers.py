"""Where jobs run: what a text names, what is missing, and calls that are lost, refused, or fail."""

import os
import sys
from collections import deque
from concurrent.futures import Executor, Future

import pytest
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.support.worker_processes import Fault
from calmotion.workflow.running.workers import executor_on, finished, result_of, results_on
from odd_jobs import odd_job


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
    with pytest.raises(SettingError, match="--on"):
        next(results_on(text, None, divmod, [(1, 2)]))


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


def test_calls_on_this_machine_are_processes_of_their_own():
    found = dict(results_on("local", 2, os.getpid, [(), ()]))
    assert os.getpid() not in found.values() and len(found) == 2
    ((_, died),) = results_on("local", 1, os._exit, [(3,)])
    assert isinstance(died, Fault) and "exit status 3" in died.reason
    ((_, failed),) = results_on("local", 1, divmod, [(7, 0)])
    assert isinstance(failed, Fault) and failed.reason.startswith("ZeroDivisionError")
    ((_, refused),) = results_on("local", 1, odd_job, [("refuse", "shots")])
    assert isinstance(refused, ShotError)
    assert (refused.problem, refused.path, refused.found) == ("there are no shots", "SHOTS", None)


@pytest.mark.long
def test_calls_on_dask_come_back_refused_or_with_the_reason_why_they_are_lost():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address.replace("tcp://", "dask://")
        assert dict(results_on(address, 1, divmod, [(7, 2), (9, 4)])) == {0: (3, 1), 1: (2, 1)}
        ((_, refused),) = results_on(address, None, odd_job, [("refuse", "shots")])
        assert isinstance(refused, ShotError) and refused.path == "SHOTS"
        ((_, died),) = results_on(address, None, os._exit, [(3,)])
        assert isinstance(died, Fault) and "KilledWorker" in died.reason
