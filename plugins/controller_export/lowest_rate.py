"""The lowest rate of commands that keeps an allowed loss, with few simulations."""

from collections.abc import Callable

import numpy as np


def lowest_rate(keeps: Callable[[int], float], allowed: float, known: dict[int, float], highest: int) -> int | None:
    """The lowest whole rate whose loss is allowed while that of the next lower one is not.

    Between a rate that does and one that does not, the next one that is tried is where a power law through both has
    the allowed loss; it is kept away from the ends, so that few are needed.

    Args:
        keeps: The loss at a rate [m].
        allowed: Loss that is accepted [m].
        known: Losses that are known already, by rate; those that are found are added.
        highest: Highest rate that is tried [Hz].

    Returns:
        The rate [Hz]; None where not even the highest keeps it.
    """

    def loss(rate: int) -> float:
        if rate not in known:
            known[rate] = keeps(rate)
        return known[rate]

    good = min((rate for rate, value in known.items() if value <= allowed), default=None)
    bad = max((rate for rate, value in known.items() if value > allowed and (good is None or rate < good)), default=0)
    while good is None:
        if bad >= highest:
            return None
        tried = min(max(2 * bad, 1), highest)
        if loss(tried) <= allowed:
            good = tried
        else:
            bad = tried
    while good - bad > 1:
        tried = _between(bad, good, known, allowed)
        if loss(tried) <= allowed:
            good = tried
        else:
            bad = tried
    return good


def _between(bad: int, good: int, known: dict[int, float], allowed: float) -> int:
    """A rate between one that is too low and one that is high enough."""
    if bad == 0:
        # the loss goes with the square of the period, or not as fast
        guess = good * np.sqrt(max(known[good], 1e-12) / allowed)
    else:
        logs = np.log([known[bad] / allowed, max(known[good], 1e-12) / allowed])
        share = logs[0] / (logs[0] - logs[1]) if logs[0] > logs[1] else 0.5
        guess = bad * (good / bad) ** share
    width = good - bad
    return int(min(max(round(guess), bad + max(1, width // 10)), good - max(1, width // 10)))
