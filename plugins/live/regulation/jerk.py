"""Speeds of motors whose accelerations may change by so much only, for commands that run straight between two ticks.

Whether a motor can still keep its limits is found by braking it, tick by tick: it slows down as hard as it may, and
lets go such that acceleration and speed are gone together. A change that leaves such a way to rest is allowed.
"""

import numpy as np
from calmotion.arrays import Array, IntArray
from numba import njit

LONGEST = 20_000  # ticks of braking
STEPS = 40  # of bisections
GONE = 1e-12  # speed, and distance beyond a limit, that is nothing
POSITION, VELOCITY, ACCELERATION, JERK = 0, 1, 2, 4  # in `limits.NAMES`


@njit(cache=True)  # type: ignore[untyped-decorator]
def braking(speed: float, change: float, hardest: float, most: float) -> float:
    """The next change of a speed a tick with which a motor comes to rest.

    Changes n m - m (m - 1) / 2 apart end at zero together with the speed, where n falls by one for each tick.

    Args:
        speed: After the last tick [rad/s or m/s].
        change: The last change of it, a tick.
        hardest, most: Largest change, and largest difference of two changes.
    """
    steps = abs(speed) / most
    ticks = max(np.ceil(np.sqrt(0.25 + 2.0 * steps) - 0.5), 1.0)
    size = min(abs(speed) / ticks + 0.5 * most * (ticks - 1.0), hardest)
    aim = -size if speed > 0.0 else size
    found: float = min(max(aim, change - most), change + most)
    return found


@njit(cache=True)  # type: ignore[untyped-decorator]
def stops(
    position: float, speed: float, change: float, lower: float, upper: float, fastest: float, hardest: float,
    most: float, tick: float,
) -> bool:  # fmt: skip
    """Whether braking keeps a motor within its limits until it rests."""
    for _ in range(LONGEST):
        if not (lower - GONE <= position <= upper + GONE and abs(speed) <= fastest + GONE):
            return False
        if abs(speed) <= GONE and abs(change) <= most:
            return True
        change = braking(speed, change, hardest, most)
        speed += change
        position += tick * speed
    return False


@njit(cache=True)  # type: ignore[untyped-decorator]
def kept_change(
    position: float, speed: float, change: float, wanted: float, lower: float, upper: float, fastest: float,
    hardest: float, most: float, tick: float,
) -> float:  # fmt: skip
    """The change of a speed next to a wanted one from which braking keeps the limits."""
    tried = min(max(wanted, change - most, -hardest), change + most, hardest)
    safe, far = braking(speed, change, hardest, most), tried
    for step in range(STEPS):
        now = speed + tried
        if stops(position + tick * now, now, tried, lower, upper, fastest, hardest, most, tick):
            if step == 0:
                return tried
            safe = tried
        else:
            far = tried
        tried = 0.5 * (safe + far)
    found: float = safe
    return found


@njit(cache=True)  # type: ignore[untyped-decorator]
def kept_with_jerk(
    position: Array, speed: Array, change: Array, wanted: Array, lower: Array, upper: Array, fastest: Array,
    hardest: Array, most: Array, tick: float,
) -> tuple[Array, IntArray]:  # fmt: skip
    """Speeds of the next tick next to wanted ones, and what acted; see `MotorLimits.kept`.

    Args:
        change: Of the speeds with the last tick, shape [M]; `hardest` and `most` as of `braking`, infinite `most` for
            motors that are left as they are wanted.
    """
    found, which = wanted.copy(), np.full(len(wanted), -1, np.int32)
    for k in range(len(wanted)):
        if not np.isfinite(most[k]):
            continue
        asked = wanted[k] - speed[k]
        kept = kept_change(
            position[k], speed[k], change[k], asked, lower[k], upper[k], fastest[k], hardest[k], most[k], tick
        )
        found[k] = speed[k] + kept
        if abs(kept - asked) > 1e-9 * max(abs(asked), GONE):
            if abs(kept) >= hardest[k] * (1.0 - 1e-9):
                which[k] = ACCELERATION
            elif abs(abs(kept - change[k]) - most[k]) <= 1e-9 * most[k]:
                which[k] = JERK
            else:
                which[k] = VELOCITY if abs(found[k]) > fastest[k] - hardest[k] else POSITION
    return found, which


@njit(cache=True)  # type: ignore[untyped-decorator]
def approach(gap: Array, speed: Array, change: Array, aim: Array, hardest: Array, most: Array, tick: float) -> Array:
    """Speeds with which motors come to places that move, and do not pass them, shape [M].

    Args:
        gap: From the motors to where the places are at the next tick [rad or m].
        aim: Speeds of the places.
    """
    found = speed.copy()
    for k in range(len(gap)):
        if not np.isfinite(most[k]):
            continue
        # at once, where the motor is there already or can also stay there
        at_once, before, relative = gap[k] / tick - speed[k], gap[k] - tick * aim[k], speed[k] - aim[k]
        stays = abs(before) <= GONE or abs(aim[k] - gap[k] / tick - at_once) <= most[k]
        if stays and abs(at_once - change[k]) <= most[k] and abs(at_once) <= hardest[k]:
            found[k] = gap[k] / tick
            continue
        far = np.inf if before >= 0.0 else -np.inf
        ends = (-np.inf, 0.0) if before >= 0.0 else (0.0, np.inf)
        found[k] += kept_change(-before, relative, change[k], far, ends[0], ends[1], np.inf, hardest[k], most[k], tick)
    return found
