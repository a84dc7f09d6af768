"""Spin-up of a flexible beam against published values."""

import numpy as np
import pytest
from calmotion.multibody.failure import SimulationFailure
from spin_up import LARGEST, LARGEST_AT, LENGTH, PUBLISHED, angle, beam, rate


def test_the_nonlinear_basis_follows_the_published_values():
    t, tip, _ = beam("stvk").swing(angle, rate, 1.0 / 120.0, 18.0)
    across = -tip[:, 1]
    for time, value in PUBLISHED.items():
        assert np.interp(time, t, across) == pytest.approx(value, rel=0.01)
    lowest = across.argmin()
    assert across[lowest] == pytest.approx(LARGEST, rel=0.005)
    assert t[lowest] == pytest.approx(LARGEST_AT, abs=0.02)


def test_a_linear_floating_frame_diverges():
    with pytest.raises(SimulationFailure):
        _, tip, _ = beam("linear").swing(angle, rate, 1.0 / 120.0, 18.0)
        # or it goes far beyond its length, without a failure
        if np.abs(tip).max() > 10.0 * LENGTH:
            raise SimulationFailure(0.0, 0, "diverged")
