"""One thread for dense products."""

import numpy as np
import pytest
from calmotion.linear_algebra.blas_threads import _controller, one_blas_thread


def threads():
    return [library["num_threads"] for library in _controller().info() if library["user_api"] == "blas"]


def test_within_there_is_one_thread_and_after_it_as_many_as_before():
    before = threads()
    assert before, "NumPy comes with a BLAS that is known"
    with pytest.raises(ZeroDivisionError), one_blas_thread():
        assert set(threads()) == {1}
        with one_blas_thread():
            assert np.allclose(np.eye(300) @ np.eye(300), np.eye(300))
        assert set(threads()) == {1}
        raise ZeroDivisionError
    assert threads() == before
