"""Work in processes that raise, crash and hang."""

import os

from calmotion.support.worker_processes import Fault, results_of
from odd_jobs import odd_job


def test_what_fails_costs_its_own_result_only():
    work = [("", 1), ("raise", 2), ("crash", 3), ("", 4), ("exit", 5), ("hang", 6), ("", 7)]
    found = dict(results_of(odd_job, work, jobs=1, patience=4.0))
    assert [found[k][0] for k in (0, 3, 6)] == [1, 4, 7]
    assert found[1] == Fault("ValueError: no 2")
    assert "SIGSEGV" in found[2].reason and "exit status 3" in found[4].reason and "within 4 s" in found[5].reason
    assert os.getpid() not in {found[k][1] for k in (0, 3, 6)}
    assert found[0][1] != found[3][1], "a new process after a crash"


def test_processes_are_kept_and_share_the_work():
    found = dict(results_of(odd_job, [("", k) for k in range(6)], jobs=2))
    assert [found[k][0] for k in range(6)] == list(range(6))
    assert len({pid for _, pid in found.values()}) <= 2
    assert dict(results_of(odd_job, [], jobs=2)) == {}
