"""How much robots of other frequencies may count, so that the robot of the model hardly loses by it.

What the commands leave on a slower and a faster robot falls at once as these begin to count; what they leave on the
robot of the model grows by the square, from next to nothing where there are motors enough and the look-ahead is long.
"""

from collections.abc import Callable

import numpy as np
from calmotion.arrays import Array
from calmotion.simulation import impulses, vibrating

from .gains import Gains

SLACK = 0.15  # of what an input shaper leaves, that may be left on the robot of the model in these moves
LEAST, EQUAL = 1e-3, 2 / 3  # of what counts, that two other robots are worth
STEPS = 6  # of bisections from the one to the other
PERIODS = 3.0  # of the slowest mode, that a move of the test lasts
LONGEST_S, HIGHEST = 6.0, 50.0  # of such a move [s]; frequency that is taken where nothing is slower [Hz]


def affordable_others(make: Callable[[float], Gains], coupling: Array, tick: float, most: float = EQUAL) -> float:
    """The greatest share of other robots with which the commands leave at most `SLACK` of what a shaper does.

    Args:
        make: Gains in a pose, with a share of other robots in what counts.
        coupling: Of all motors with those that may deviate, shape [M, m].
        tick: [s].
        most: The greatest share that is thought of.
    """

    test = None

    def affords(share: float) -> bool:
        nonlocal test
        gains = make(share)
        test = test or Moves(gains, coupling, tick)
        return test.left_by(gains) <= SLACK * test.left_by_shaper

    if most <= LEAST or affords(most):
        return most
    if not affords(LEAST):
        return 0.0
    low, high = np.log(LEAST), np.log(most)
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if affords(float(np.exp(middle))) else (low, middle)
    return float(np.exp(low))


class Moves:
    """Smooth moves, one of each motor that may deviate, played by the robot of the model in a pose, which is linear.

    Args:
        gains: In the pose; `coupling` and `tick` as of `affordable_others`.

    Attributes:
        left_by_shaper: What the shaper ZV leaves with the delay that suits it best [m], a root of a sum of squares.
    """

    def __init__(self, gains: Gains, coupling: Array, tick: float):
        self._coupling, self._tick, self._known = coupling, tick, len(gains.preview)
        omega, ratio = 2.0 * np.pi * HIGHEST, 0.0
        with np.errstate(divide="ignore", invalid="ignore"):  # of free motions
            ratios = np.diag(gains.pose.damping) / (2.0 * gains.pose.omega)
        for k in np.flatnonzero(vibrating(gains.pose.omega / (2.0 * np.pi), ratios))[:1]:
            omega, ratio = min(float(gains.pose.omega[k]), omega), float(ratios[k])
        period = min(2.0 * np.pi / omega, LONGEST_S / PERIODS)
        self._lasts, rest = PERIODS * period, round(2.0 * period / tick)
        self._times = tick * np.arange(-self._known - 1, round(self._lasts / tick) + rest + self._known + 1)
        shaped = np.zeros(len(self._times))
        for late, share in zip(*impulses("zv", np.array([omega / (2.0 * np.pi)]), np.array([ratio])), strict=True):
            shaped += share * self._moved(late)
        rows, x, swings = self._rows(gains), np.zeros((len(gains.transition), coupling.shape[1])), []
        for strike in self._struck(gains, shaped):
            swings.append(rows @ x)
            x = gains.transition @ x + gains.by_impulse @ strike
        late_by = [
            np.multiply.outer((shaped - self._moved(tick * k))[1:-1], rows[:, : x.shape[1]]) for k in range(rest)
        ]
        self.left_by_shaper = min(float(np.linalg.norm(np.array(swings) + late)) for late in late_by)

    def left_by(self, gains: Gains) -> float:
        """What a regulator leaves in this pose [m], a root of a sum of squares."""
        strikes, rows, known = self._struck(gains, self._moved(0.0)), self._rows(gains), self._known
        x, sum_of_squares = np.zeros((len(gains.transition), self._coupling.shape[1])), 0.0
        preview = gains.preview.transpose(1, 0, 2).reshape(len(gains.feedback), -1)
        for k in range(len(strikes) - known):
            changes = -gains.feedback @ x - preview @ strikes[k : k + known].reshape(-1, x.shape[1])
            sum_of_squares += float(np.sum((rows @ x) ** 2))
            x = gains.transition @ x + gains.by_change @ changes + gains.by_impulse @ strikes[k]
        return float(np.sqrt(sum_of_squares))

    def _moved(self, late: float) -> Array:
        s = np.clip((self._times - late) / self._lasts, 0.0, 1.0)
        return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))

    def _struck(self, gains: Gains, way: Array) -> Array:
        """Impulses of a way of each motor, shape [T - 2, S n, m]."""
        accelerations, rates = np.diff(way, 2) / self._tick**2, (way[2:] - way[:-2]) / (2.0 * self._tick)
        none = np.zeros((len(rates), len(gains.pose.shapes)))
        each = [
            gains.impulses(np.outer(accelerations, one), np.outer(rates, one), none, self._tick)
            for one in self._coupling.T
        ]
        return np.stack(each, axis=2)

    @staticmethod
    def _rows(gains: Gains) -> Array:
        """Motion of the targets on the robot of the model by the state, whatever its share is."""
        rows = np.array_split(gains.targets, gains.robots)[gains.robots // 2]
        return np.asarray(rows / max(float(np.linalg.norm(rows[:, : gains.by_change.shape[1]])), 1e-300))
