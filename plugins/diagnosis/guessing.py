"""Loops whose gains are not known, as encoders show them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from calmotion.arrays import Array
from scipy.optimize import least_squares

from .signals import HEALTHY, Joint, Sensor
from .situation import Situation

GUESSED = np.geomspace(5.0, 200.0, 12)  # frequencies of loops whose gains are not known, where the search begins [Hz]
DAMPINGS = (HEALTHY, 3.0)  # ratios of critical that they may have


def with_guessed_loops(situation: Situation) -> Situation:
    """The situation with gain and damping of each loop that the shot does not tell, as its encoder shows them: healthy
    loops lag, too. A joint that follows exactly as well as by any loop has no gain."""
    joints = list(situation.joints)
    for m, k in situation.encoders.items():
        if joints[m].gain and not joints[m].guessed:
            continue
        joint, sensor = joints[m], situation.sensors[k]

        def left(own: Joint, m: int = m, sensor: Sensor = sensor) -> Array:
            tried = replace(situation, joints=(*joints[:m], own, *joints[m + 1 :]))
            moved = tried.moved(tried.healthy, only=m)[0][:, 0]
            off = sensor.values[:, 0] - np.interp(sensor.times, situation.times, moved)
            return np.asarray((off - np.median(off)) / sensor.noise)

        exact = replace(joint, gain=0.0, guessed=True)
        found = [(float(np.sum(np.sqrt(1.0 + left(exact) ** 2) - 1.0)), exact)]
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
