"""Calls as independent jobs: refusals keep their fields, what is lost with a worker is tried again, nothing else is."""

import os
from concurrent.futures import Future

import pytest
from calmotion.errors import ShotError
from calmotion.support.processes.workers import Fault
from calmotion.workflow.batch.backends import Backend, LocalBackend
from calmotion.workflow.batch.calls import MOST_ATTEMPTS, results_on
from calmotion.workflow.batch.jobs import jobs_for


class Losing(Backend):
    """Calls that run at once, of which the first ones are lost."""

    def __init__(self, lost, revives=True):
        self.lost, self.revives, self.calls, self.revived, self.closed = lost, revives, 0, 0, False

    def submit(self, fields, avoid):
        raise NotImplementedError

    def call(self, function, *arguments):
        self.calls += 1
        future = Future()
        if self.calls <= self.lost:
            future.set_exception(OSError("the node is gone"))
        else:
            future.set_result(function(*arguments))
        return future

    def revive(self):
        self.revived += 1
        return self.revives

    def close(self):
        self.closed = True


def test_what_is_lost_with_a_worker_is_called_again():
    backend = Losing(2)
    assert dict(results_on(backend, divmod, [(7, 2), (9, 4), (5, 5)])) == {0: (3, 1), 1: (2, 1), 2: (1, 0)}
    assert backend.calls == 5 and backend.revived and backend.closed


def test_workers_that_always_die_end_a_call():
    ((index, found),) = results_on(backend := Losing(99), divmod, [(7, 2)])
    assert index == 0 and isinstance(found, Fault) and "the node is gone" in found.reason
    assert backend.calls == MOST_ATTEMPTS


def test_a_backend_that_is_gone_ends_all_calls():
    found = dict(results_on(Losing(1, revives=False), divmod, [(7, 2), (9, 0)]))
    assert isinstance(found[0], Fault) and isinstance(found[1], Fault)


def test_a_call_that_fails_or_is_refused_is_not_called_again(tmp_path):
    ((_, failed),) = results_on(backend := Losing(0), divmod, [(7, 0)])
    assert isinstance(failed, Fault) and failed.reason.startswith("ZeroDivisionError") and backend.calls == 1
    ((_, refused),) = results_on(backend := Losing(0), jobs_for, [([], str(tmp_path), "optimize")])
    assert isinstance(refused, ShotError) and backend.calls == 1
    assert (refused.problem, refused.path, refused.found) == ("there are no shots", "SHOTS", None)


def test_calls_on_this_machine_are_processes_of_their_own():
    found = dict(results_on(LocalBackend(2), os.getpid, [(), ()]))
    assert len({*found.values(), os.getpid()}) == 3
    backend = LocalBackend(1)
    with pytest.raises(RuntimeError, match="exit status 3"):
        backend.call(os._exit, 3).result(timeout=600)
    backend.close()
