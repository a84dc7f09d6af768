"""Independent pieces of work in threads."""

import threading
import time

import pytest
from calmotion.simulation.parallel import in_parallel


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
