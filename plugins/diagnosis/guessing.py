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
    loops lag, too."""
    joints = list(situation.joints)
    for m, k in situation.encoders.items():
        if joints[m].gain and not joints[m].guessed:
            continue
        joint, sensor = joints[m], situation.sensors[k]
        found = []
        for load in (joint.load, np.zeros_like(joint.load)):  # many controllers hold a load without an error

            def tried(x: Array, load: Array = load, joint: Joint = joint) -> Joint:
                gain = (2.0 * np.pi * float(np.exp(x[0]))) ** 2 * joint.middle
                return replace(joint, load=load, gain=gain, damping=float(x[1]) * joint.critical(gain), guessed=True)

            def off(x: Array, m: int = m, sensor: Sensor = sensor) -> Array:
                own = replace(situation, joints=(*joints[:m], tried(x), *joints[m + 1 :]))
                moved = own.moved(own.healthy, only=m)[0][:, 0]
                left = sensor.values[:, 0] - np.interp(sensor.times, situation.times, moved)
                return np.asarray((left - np.median(left)) / sensor.noise)

            start = min(([np.log(f), 1.0] for f in GUESSED), key=lambda x: float(np.mean(np.abs(off(np.array(x))))))
            low, high = zip((np.log(4.0), np.log(250.0)), DAMPINGS, strict=True)
            # a part of the samples may show a fault
            best = least_squares(off, start, bounds=(low, high), loss="soft_l1", diff_step=1e-3, max_nfev=15)
            found.append((float(best.cost), tried(best.x)))
        joints[m] = min(found, key=lambda pair: pair[0])[1]
    return replace(situation, joints=tuple(joints))
