"""The point with the least value of a function that costs little: an evolution strategy of one parent and one child."""

from collections.abc import Callable

import numpy as np
from calmotion.arrays import Array

AT_RANDOM = 0.3  # of the tries: points that have nothing to do with one another
CHANGE, GROWN, SHRUNK = 0.6, 1.5, 0.85  # first size of a change, and its factors after a success and a failure


def least_point(value: Callable[[Array], float], size: int, tries: int, random: np.random.Generator) -> Array:
    """The best of some levels and phases, shape [size], levels first.

    Args:
        value: What is to be small.
        size: Number of levels and phases.
        tries: How often the function is called.
        random: Of the points.
    """
    half = size // 2
    best, least, change = np.zeros(size), np.inf, CHANGE
    for k in range(tries):
        local = k >= AT_RANDOM * tries
        if local:
            then = best + change * random.standard_normal(size) * np.repeat([1.0, np.pi / 2], half)
        else:
            then = np.concatenate([random.standard_normal(half), random.uniform(-np.pi, np.pi, size - half)])
        found = value(then)
        better = found < least
        if better:
            best, least = then, found
        if local:
            change *= GROWN if better else SHRUNK
    return best
