"""One thread for dense products."""

import numpy as np
import pytest
from calmotion.fem.blas_threads import _switches, one_blas_thread


def test_within_there_is_one_thread_and_after_it_as_many_as_before():
    if not _switches():
        pytest.skip("NumPy and SciPy use another BLAS than OpenBLAS here")

    def threads():
        return [getter() for getter, _ in _switches()]

    before = threads()
    with pytest.raises(ZeroDivisionError), one_blas_thread():
        assert set(threads()) == {1}
        with one_blas_thread():
            assert np.allclose(np.eye(300) @ np.eye(300), np.eye(300))
        assert set(threads()) == {1}
        raise ZeroDivisionError
    assert threads() == before
