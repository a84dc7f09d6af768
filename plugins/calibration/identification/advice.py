"""Which further measurement would tell a parameter that the recordings do not tell."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.recordings import ACCELEROMETER, ANGLE, EFFORT, MARKER

from ..model import kinds
from .problem import Calibrated

RATE = 100.0  # of the sensors that are imagined [Hz]
NOISE: Mapping[str, float] = {MARKER: 5e-4, ACCELEROMETER: 0.1, ANGLE: 5e-4}  # [m], [m/s^2], [rad or m]
EFFORT_NOISE = 0.05  # of the largest effort, which motors tell by their current
IDENTIFIABLE = 0.7  # posterior over prior standard deviation from which recordings tell less than the prior
WORDS = {MARKER: "a marker at", ACCELEROMETER: "an accelerometer at", ANGLE: "the encoder of", EFFORT: "the torque of"}


@dataclass(frozen=True)
class Advice:
    """A measurement, and what it would tell.

    Attributes:
        kind, path: Of the channel.
        sigma: Standard deviation of the parameter with it, over that of its prior.
    """

    kind: str
    path: str
    sigma: float

    @property
    def sentence(self) -> str:
        """What to measure."""
        return f"{WORDS[self.kind]} {self.path}, on the clock of the commands, would"


def advised(problem: Calibrated, information: Array, z: Array) -> dict[int, Advice]:
    """For each parameter of the robot that the recordings do not tell, the one sensor that tells it best.

    Each target may get a marker or an accelerometer, each motor an encoder or a measurement of its torque, for the same
    performance; constants of a sensor tell nothing, since its place and bias are not known.

    Args:
        problem: After a search, with the differences of its last linearisation.
        information: Inverse of the covariance of z, shape [n, n].
        z: Where.
    """
    differences, count = problem.differences, len(problem.parameters)
    if differences is None or not count:
        return {}
    deviations = np.sqrt(np.diag(np.linalg.inv(information)))[:count]
    missing = [
        k
        for k, (p, deviation) in enumerate(zip(problem.parameters, deviations, strict=True))
        if p.kind in kinds.ROBOT_KINDS and deviation > IDENTIFIABLE
    ]
    if not missing:
        return {}
    here = problem.signals(z)[0]
    times = np.arange(max(0.0, here.times[0]), here.times[-1], 1.0 / RATE)
    character = problem.shot.character
    candidates = [(kind, k, t.path) for k, t in enumerate(character.targets) for kind in (MARKER, ACCELEROMETER)]
    candidates += [(kind, k, m.path) for k, m in enumerate(character.motors) for kind in (ANGLE, EFFORT)]
    best: dict[int, Advice] = {}
    for kind, index, path in candidates:
        noise = NOISE.get(kind) or max(EFFORT_NOISE * float(np.abs(here.at(kind, index, times)).max()), 1e-9)
        changes = differences.of(lambda motions, kind=kind, index=index: motions[0].at(kind, index, times))  # type: ignore[misc]
        J = np.stack([((change - change.mean(axis=0)) / noise).ravel() for change in changes], axis=1)
        more = information.copy()
        more[:count, :count] += J.T @ J
        sigmas = np.sqrt(np.diag(np.linalg.inv(more)))
        for k in missing:
            if sigmas[k] < IDENTIFIABLE and (k not in best or sigmas[k] < best[k].sigma):
                best[k] = Advice(kind, path, float(sigmas[k]))
    return best
