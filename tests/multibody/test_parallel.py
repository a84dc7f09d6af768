"""Independent pieces of work in threads."""

import multiprocessing
import threading
import time

import pytest
from calmotion.multibody import parallel
from calmotion.multibody.parallel import in_parallel


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    """On one, there are no threads."""
    monkeypatch.setattr(parallel, "processors", lambda: 2)


def test_results_keep_the_order_of_the_items():
    assert in_parallel(lambda n: n * n, range(9)) == [n * n for n in range(9)]
    assert in_parallel(lambda n: n, []) == []


def test_the_first_failure_is_raised_after_all_have_ended():
    ended = threading.Event()

    def work(n):
        if n < 2:
            raise ValueError(str(n))
        time.sleep(0.05)
        ended.set()

    with pytest.raises(ValueError, match="0"):
        in_parallel(work, range(3))
    assert ended.is_set()


def test_progress_is_reported_in_the_thread_that_waits_and_may_end_the_work():
    counts, threads = [], set()

    def done(number):
        counts.append(number)
        threads.add(threading.current_thread())

    assert in_parallel(lambda n: time.sleep(0.01) or n, range(4), done) == [0, 1, 2, 3]
    assert counts == sorted(counts) and counts[0] == 0 and threads == {threading.current_thread()}

    def stop(number):
        if number:
            raise KeyboardInterrupt

    begun = []
    with pytest.raises(KeyboardInterrupt):
        in_parallel(lambda n: begun.append(n) or time.sleep(0.02), range(10_000), stop)
    assert len(begun) < 10_000, "what had not begun is left out"


def test_work_within_work_does_not_wait_for_itself():
    assert in_parallel(lambda n: sum(in_parallel(lambda k: k * n, range(3))), range(4)) == [0, 3, 6, 9]


def _of_a_child(pipe):
    pipe.send(in_parallel(lambda n: n * n, range(4)))


@pytest.mark.posix
def test_a_forked_process_has_threads_of_its_own():
    assert in_parallel(lambda n: n, range(4)) == [0, 1, 2, 3]
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    child = context.Process(target=_of_a_child, args=(there,), daemon=True)
    child.start()
    try:
        assert here.poll(60.0), "the child waits for threads that only its parent has"
        assert here.recv() == [0, 1, 4, 9]
    finally:
        child.kill()
        child.join()
