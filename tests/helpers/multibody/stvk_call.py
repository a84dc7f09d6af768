"""The compiled forces of a St. Venant-Kirchhoff body, called with scratch of their own."""

from __future__ import annotations

import numpy as np
from calmotion.multibody.kernels.stvk import stvk_forces


def call_stvk(gram, u, v, beta, tangent, res, P, K, seen=None, before=0):
    """`stvk_forces` of one body whose data start after some others' in the flat array."""
    r = len(u)
    p = r if seen is None else len(seen)
    data = [np.full(before, np.nan), gram.ravel(), *([] if seen is None else [seen.ravel()])]
    size = len(gram)
    stvk_forces(
        r, p, u, v, beta, before, np.concatenate(data), tangent, np.full(2 * size, np.nan), np.full((p, size), np.nan),
        np.full((3, p), np.nan), np.full(p, np.nan), np.full((p, r), np.nan), res, P, K,
    )  # fmt: skip
