"""The residuals of recordings as functions of a robot's parameters, by simulations in parallel.

The derivative by a parameter of the robot is the difference to a simulation that is 0.01% of the prior's standard
deviation away, so that the phase of fast modes hardly changes between them at the end of a long recording; that by a
parameter of the measurement is exact.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import RunSettings
from calmotion.multibody import SimulationFailure, in_parallel
from calmotion.simulation import CompiledShot
from calmotion.support import check

from .measurement import Measurement, Motions
from .recordings.noise import correlation_time, least_sigma, spread_of
from .recordings.sensors import Sensor
from .robots import robot_at
from .signals import signals_of, with_rotors
from .takes import Take

DIFFERENCE = 1e-4  # of the prior's standard deviation
FAR = 40.0  # standard deviations of the priors, beyond which a step of a search is not tried


@dataclass(frozen=True, eq=False)
class Differences:
    """Signals at x, and at x + `DIFFERENCE` of each parameter.

    Attributes:
        at: x, shape [n].
        here: Signals there, of each shot.
        ahead: The same for each parameter of the robot.
    """

    at: Array
    here: Motions
    ahead: tuple[Motions, ...]

    def of(self, values: Callable[[Motions], Array]) -> list[Array]:
        """Derivatives by the parameters of values of the signals."""
        here = values(self.here)
        return [np.asarray((values(ahead) - here) / DIFFERENCE) for ahead in self.ahead]


class Calibrated:
    """A robot and its recordings, as a `least_squares.Problem`: z has the robot's parameters, then the measurement's.

    Args:
        takes: Shots of one robot.
        measurement: Its sensors.
        options: With step and integrator.
        tell: Called with each simulation.
    """

    def __init__(
        self,
        takes: Sequence[Take],
        measurement: Measurement,
        options: RunSettings,
        tell: Callable[[], None] = lambda: None,
    ):
        self.takes, self.measurement, self.options, self.tell = tuple(takes), measurement, options, tell
        self.shot, self.parameters = self.takes[0].shot, self.takes[0].parameters
        self._last: tuple[Array, Motions] | None = None
        self.differences: Differences | None = None
        self._own = False  # whether they were made with these options
        self.simulations = 0

    @property
    def lower(self) -> Array:
        """Least values of z."""
        return np.array([p.least for p in (*self.parameters, *self.measurement.parameters)])

    @property
    def counts(self) -> Array:
        """How many successive residuals count as one, shape [N]."""
        return self.measurement.counts

    def with_measurement(self, measurement: Measurement) -> Calibrated:
        """The same with other noise of the sensors; what was simulated is kept."""
        other = Calibrated(self.takes, measurement, self.options, self.tell)
        other._last, other.differences, other._own = self._last, self.differences, self._own
        other.simulations = self.simulations
        return other

    def with_options(self, options: RunSettings) -> Calibrated:
        """The same with another step; the differences are kept."""
        other = Calibrated(self.takes, self.measurement, options, self.tell)
        other.differences, other.simulations = self.differences, self.simulations
        return other

    def signals(self, z: Array) -> Motions:
        """Of the robot at z in each shot, in the thread of the caller.

        Raises:
            ShotError: It cannot be simulated.
            SimulationFailure: A step fails.
        """
        check()
        x = z[: len(self.parameters)]
        if self._last is None or not np.array_equal(self._last[0], x):
            self._last = x.copy(), self._simulated(x)
        return self._last[1]

    def residuals(self, z: Array) -> Array | None:
        """(measured - predicted) / sigma, shape [N]; None where the robot cannot be simulated."""
        if not np.all(np.abs(z[: len(self.parameters)]) < FAR):
            return None
        try:
            signals = self.signals(z)
        except (ShotError, SimulationFailure):
            return None
        return self.measurement.residuals(signals, z[len(self.parameters) :])

    def linearized(self, z: Array) -> tuple[Array, Array]:
        """The residuals and their derivative, shape [N, n].

        Raises:
            ShotError: The robot cannot be simulated there.
            SimulationFailure: A step fails.
        """
        n, measurement = len(self.parameters), self.measurement
        x, y = z[:n], z[n:]
        here = self.signals(z)
        known = self.differences
        found = known if known is not None and self._own and np.array_equal(known.at, x) else self._differences(x, here)
        self.differences, self._own = found, True
        columns = [
            -measurement.weighted(change)
            for change in zip(
                *[
                    found.of(lambda signals, sensor=sensor: measurement.predicted(signals, sensor, y))  # type: ignore[misc]
                    for sensor in measurement.sensors
                ],
                strict=True,
            )
        ]
        by_measurement = -measurement.weighted(
            [measurement.derivatives(here, sensor, y) for sensor in measurement.sensors]
        )
        by_robot = np.stack(columns, axis=1) if columns else np.zeros((len(by_measurement), 0))
        return measurement.residuals(here, y), np.concatenate([by_robot, by_measurement], axis=1)

    def _differences(self, x: Array, here: Motions) -> Differences:
        points = [x + unit for unit in DIFFERENCE * np.eye(len(self.parameters))]
        # with the same steps: else these jump a little, and the differences a lot
        return Differences(x.copy(), here, tuple(in_parallel(lambda ahead: self._simulated(ahead, here), points)))

    def _simulated(self, x: Array, like: Motions | None = None) -> Motions:
        return self.simulated(x, [take.shot for take in self.takes], like)

    def simulated(self, x: Array, shots: Sequence[CompiledShot], like: Motions | None = None) -> Motions:
        """Signals of the robot at x in shots that stand for those of the takes.

        Args:
            x: In standard deviations of the priors, shape [n].
            shots: The shots.
            like: Signals from which these hardly differ, whose steps they have.

        Raises:
            ShotError: It cannot be simulated.
            SimulationFailure: A step fails.
        """
        found, last = [], self._last  # which another thread may replace
        for k, (take, shot) in enumerate(zip(self.takes, shots, strict=True)):
            robot, moving = robot_at(shot, take.parameters, x), take.moving
            if last is not None and shot is take.shot and np.array_equal(last[0][moving], x[moving]):
                found.append(with_rotors(last[1][k], robot))
                continue
            self.simulations += 1
            self.tell()
            divided = None if like is None else like[k].divided
            found.append(signals_of(robot, self.options, take.after, take.start, take.begin, divided))
        return found


class Measured:
    """The parameters of the measurement alone, for one motion: nothing is simulated."""

    def __init__(self, measurement: Measurement, motions: Motions):
        self._measurement, self._signals = measurement, motions

    @property
    def counts(self) -> Array:
        """How many successive residuals count as one, shape [N]."""
        return self._measurement.counts

    def residuals(self, z: Array) -> Array | None:
        """(measured - predicted) / sigma, shape [N]."""
        return self._measurement.residuals(self._signals, z)

    def linearized(self, z: Array) -> tuple[Array, Array]:
        """With their derivative, shape [N, m]."""
        change = [self._measurement.derivatives(self._signals, sensor, z) for sensor in self._measurement.sensors]
        return self._measurement.residuals(self._signals, z), -self._measurement.weighted(change)


def correlated(problem: Calibrated, z: Array) -> Measurement:
    """The measurement with the number of successive samples that count as one, as the residuals have it."""
    measurement, y = problem.measurement, z[len(problem.parameters) :]
    motions = problem.signals(z)

    def of(sensor: Sensor) -> Sensor:
        off = sensor.channel.values - measurement.predicted(motions, sensor, y)
        return replace(sensor, count=correlation_time(np.where(sensor.fitted, off, np.nan)[sensor.used]))

    return measurement.with_sensors([of(sensor) for sensor in measurement.sensors])


def renoised(problem: Calibrated, z: Array) -> Measurement:
    """The measurement with the noise of its sensors as the residuals have it, where it is not given.

    A sensor has one noise in all shots: a shot that the model does not explain would else count as noise.
    """
    measurement, y = problem.measurement, z[len(problem.parameters) :]
    motions, left = problem.signals(z), dict[object, list[Array]]()
    places: list[tuple[str, str, int, int]] = []
    for sensor in measurement.sensors:
        off = sensor.channel.values - measurement.predicted(motions, sensor, y)
        rank = sum(other[:3] == (sensor.channel.kind, sensor.channel.path, sensor.take) for other in places)
        places.append((sensor.channel.kind, sensor.channel.path, sensor.take, rank))
        left.setdefault((sensor.channel.kind, sensor.channel.path, rank), []).append(off[sensor.fitted])
    spreads = {key: spread_of(np.concatenate(values)) for key, values in left.items()}

    def of(sensor: Sensor, place: tuple[str, str, int, int]) -> Sensor:
        if sensor.channel.sigma is not None:
            return replace(sensor, sigma=sensor.channel.sigma)
        spread = spreads[place[0], place[1], place[3]]
        return replace(sensor, sigma=max(spread, least_sigma(sensor.channel.values)))

    sensors = [of(*item) for item in zip(measurement.sensors, places, strict=True)]
    return measurement.with_sensors(sensors)
