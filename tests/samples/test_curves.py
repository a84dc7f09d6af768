"""The curve that the samples are keyed with."""

from pathlib import Path

import numpy as np


def test_the_keyed_curve_never_overshoots_its_keys(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parents[2] / "samples"))
    from kit.curves import sample_keys

    keys = [(1.0, 0.0), (4.0, 10.0), (9.0, 11.0), (12.0, -5.0), (20.0, -5.0)]
    curve = sample_keys(keys, range(1, 22))
    assert curve[[0, 3, 8, 11, 19, 20]].tolist() == [0.0, 10.0, 11.0, -5.0, -5.0, -5.0]
    assert curve.max() == 11.0 and curve.min() == -5.0
    assert np.all(np.diff(curve[:9]) > 0.0)
