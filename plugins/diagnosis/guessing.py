"""Loops whose gains are not known, as encoders show them."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from calmotion.arrays import Array
from scipy.optimize import least_squares, minimize_scalar

from .signals import HEALTHY, Joint, Sensor
from .situation import Situation

GUESSED = np.geomspace(5.0, 200.0, 12)  # frequencies of loops whose gains are not known, where the search begins [Hz]
DAMPINGS = (HEALTHY, 3.0)  # ratios of critical that they may have
EXACT = 1.5  # what a joint may leave that follows exactly but late, of the noise and what models leave
LATE = np.arange(-0.1, 0.3, 0.005)  # by which a joint that follows exactly may be late, where the search begins [s]


def with_guessed_loops(situation: Situation) -> Situation:
    """The situation with gain and damping of each loop that the shot does not tell, as its encoder shows them: healthy
    loops lag, too. A joint that follows exactly, or exactly but late, as well as by any loop has no gain."""
    joints = list(situation.joints)
    for m, k in situation.encoders.items():
        if joints[m].gain and not joints[m].guessed:
            continue
        joint, sensor = joints[m], situation.sensors[k]

        def left(own: Joint, late: float = 0.0, m: int = m, sensor: Sensor = sensor) -> Array:
            tried = replace(situation, joints=(*joints[:m], own, *joints[m + 1 :]))
            moved = tried.moved(tried.healthy, only=m)[0][:, 0]
            off = sensor.values[:, 0] - np.interp(sensor.times - late, situation.times, moved)
            return np.asarray((off - np.median(off)) / sensor.noise)

        exact = replace(joint, gain=0.0, guessed=True)
        found = [(_cost(left(exact)), exact)]
        late = _lateness(partial(left, exact))
        # a fault may look like a delay, too: what is late alone has no other error
        if situation.weights[k] * sensor.noise * float(np.sqrt(np.mean(left(exact, late) ** 2))) < EXACT:
            found.append((_cost(left(exact, late)), exact))
        for load in (joint.load, np.zeros_like(joint.load)):  # many controllers hold a load without an error

            def loop(x: Array, load: Array = load, joint: Joint = joint) -> Joint:
                gain = (2.0 * np.pi * float(np.exp(x[0]))) ** 2 * joint.middle
                return replace(joint, load=load, gain=gain, damping=float(x[1]) * joint.critical(gain), guessed=True)

            def off(x: Array) -> Array:
                return left(loop(x))  # noqa: B023  # used in this round alone

            start = min(([np.log(f), 1.0] for f in GUESSED), key=lambda x: float(np.mean(np.abs(off(np.array(x))))))
            low, high = zip((np.log(4.0), np.log(250.0)), DAMPINGS, strict=True)
            # a part of the samples may show a fault
            best = least_squares(off, start, bounds=(low, high), loss="soft_l1", diff_step=1e-3, max_nfev=15)
            found.append((float(best.cost), loop(best.x)))
        joints[m] = min(found, key=lambda pair: pair[0])[1]
    return replace(situation, joints=tuple(joints))


def _cost(left: Array) -> float:
    """Half of a sum of squares in which large ones count less (`soft_l1`)."""
    return float(np.sum(np.sqrt(1.0 + left**2) - 1.0))


def _lateness(left: Callable[[float], Array]) -> float:
    """The delay that leaves least [s]."""
    start = min(LATE, key=lambda by: float(np.mean(np.abs(left(by)))))
    near = float(LATE[1] - LATE[0])
    found = minimize_scalar(lambda by: _cost(left(by)), bounds=(start - near, start + near), method="bounded")
    return float(found.x)
