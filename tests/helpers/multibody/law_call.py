"""The compiled forces of a nonlinear body, called with scratch of their own."""

import numpy as np
from calmotion.multibody.kernels.components import ElasticLaw
from calmotion.multibody.kernels.neohookean import neohookean_forces
from calmotion.multibody.kernels.stvk import stvk_forces
from calmotion.multibody.kernels.work import allocate_law_work


def call_stvk(gram, u, v, beta, tangent, res, P, K, seen=None, before=0):
    """`stvk_forces` of one body whose data start after some others' in the flat array."""
    r = len(u)
    p = r if seen is None else len(seen)
    data = [np.full(before, np.nan), gram.ravel(), *([] if seen is None else [seen.ravel()])]
    law = ElasticLaw(r, p, beta, np.zeros(2), before, np.concatenate(data))
    stvk_forces(law, u, v, tangent, scratch(r, p, False), res, P, K)


def call_neohookean(points, u, v, lame, beta, data, tangent, res, P, K, start=0):
    """`neohookean_forces` of one body.

    Args:
        points: Number of cubature points.
        start: Where its data start in the flat array.
    """
    law = ElasticLaw(len(u), points, beta, np.array(lame), start, data)
    neohookean_forces(law, u, v, tangent, scratch(len(u), 0, True), res, P, K)


def scratch(r, p, cubature):
    work = allocate_law_work(r, p, cubature)
    for array in work:
        array[:] = np.nan
    return work
