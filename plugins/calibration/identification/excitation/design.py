"""A short test motion that makes parameters of a robot identifiable, found by its information.

The covariance of the parameters after a recording, (J^T J + E)^-1 in standard deviations of their priors, has the
derivatives J of what the sensors will measure, over their noise; clocks, biases and places of sensors are unknown too.
The motion of a family of tones with the least determinant of the robot's block is looked for (D-optimality): motions
are compared by sums of responses to pulses (`superposition`), and those with which a few searches end are simulated;
every one that counts keeps all limits in the simulation, and the bodies of the robot apart.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import SERVO, Animation, RunSettings, Track
from calmotion.multibody import SimulationFailure
from calmotion.recordings import COMPONENTS, Channel, SensorRecording
from calmotion.simulation import CompiledShot, pose_modes

from ...model import kinds
from ...model.excitation import Clear, Excitation, MotorUse, PlannedSensor, Predicted
from ..advice import IDENTIFIABLE
from ..measurement import Measurement
from ..model_error import covariance_of_model
from ..motor_groups import grouped
from ..parameters import Parameter, robot_parameters
from ..problem import Calibrated
from ..recordings.sensors import measurement_parameters, sensors_of
from ..signals import Signals, refuse_cyclic
from ..takes import Take, simulable
from .clearance import Clearance
from .evolution import least_point
from .superposition import Superposition
from .waveforms import MARGIN, Family, bounds_of, family_of

AFTER = 1.0  # of rest after the motion, which is recorded as well [s]
EXCITED = 4  # natural frequencies that are to be excited
STEP = 1.0 / 240.0  # of the simulations that compare motions [s]
SEARCHES = 3  # which share the tries, and end with one motion each
LESS, TIMES = 0.8, 12  # share of a motion that exceeds a limit that is tried next, and how often


@dataclass(frozen=True)
class ExcitationSettings:
    """What the test motion is for.

    Attributes:
        sensors: By which it will be recorded.
        parameters, priors: As of `calibrate.CalibrationSettings`.
        duration: [s].
        amplitude, travel: Largest excursion of a hinge [rad] and of a slider [m].
        tries: Number of motions that are compared.
        seed: Of the search.
        by_motor_type: As of `calibrate.CalibrationSettings`.
    """

    sensors: tuple[PlannedSensor, ...]
    parameters: tuple[str, ...] = kinds.DEFAULT
    priors: Mapping[str, float] = field(default_factory=dict)
    duration: float = 4.0
    amplitude: float = float(np.radians(10.0))
    travel: float = 0.05
    tries: int = 1000
    seed: int = 0
    by_motor_type: bool = False


def excite_shot(
    shot: CompiledShot,
    settings: ExcitationSettings,
    options: RunSettings,
    progress: Callable[[float, str], None] = lambda fraction, message: None,
) -> Excitation:
    """Find a test motion.

    Args:
        shot: With a target at each prim that will have a sensor; its curves say what the robot may do.
        settings: What the motion is for.
        options: Step and integrator.
        progress: Called with a fraction and a message.

    Raises:
        ShotError: The shot loops, nothing may move or is to be identified, or no motion within the limits was found.
    """
    begin, animation = time.perf_counter(), shot.animation
    refuse_cyclic(shot.character.retarget.cyclic, shot.character.path)
    parameters = robot_parameters(shot, settings.parameters, settings.priors)
    if settings.by_motor_type:
        parameters = grouped(parameters, shot.character)
    bounds = bounds_of(shot.character, animation, settings.amplitude, settings.travel)
    frequencies = pose_modes(shot)[0][:EXCITED]
    family = family_of(shot.character, animation, frequencies, bounds, settings.duration)
    chosen = replace(options, step=options.step or shot.character.retarget.time_step or STEP, pre_roll=0.0)
    chosen, _ = simulable(
        _performing(shot, family, family.within(np.zeros((len(family.times), len(family.leading))))), chosen, 0.0
    )
    trial = _Trial(shot, family, parameters, settings, chosen)
    progress(0.05, "measuring a chirp")
    chirp = trial.rate(family.chirp())
    best = _searched(trial, settings, progress)
    if chirp is None or best is None:
        raise ShotError(
            "no test motion keeps all limits",
            path=shot.character.path,
            attribute="calm:motor:maxTorque",
            found=f"{SEARCHES} motions simulated",
            remedy="Check the limits, and whether bodies almost touch: the robot can hardly leave its first pose",
        )
    predicted = tuple(
        Predicted(
            p.name,
            p.kind,
            p.path,
            p.unit,
            p.nominal,
            p.slope(0.0),
            p.slope(0.0) * own,
            p.slope(0.0) * other,
            own <= IDENTIFIABLE,
        )
        for p, own, other in zip(
            [parameters[k] for k in _wanted(parameters)], best.deviations(), chirp.deviations(), strict=True
        )
    )
    return Excitation(
        family.times, best.values, predicted, _uses(shot, family, best), settings.sensors, chirp.score - best.score,
        settings.tries, time.perf_counter() - begin, _clear(shot, family, trial.clearance, best),
        trial.clearance.together,
    )  # fmt: skip


def _searched(trial: _Trial, settings: ExcitationSettings, progress: Callable[[float, str], None]) -> _Rated | None:
    """The best of the motions with which some searches end."""
    family, wanted = trial.family, _wanted(trial.parameters)
    progress(0.2, "simulating a pulse of each motor")
    responses = Superposition(family, trial.problem)
    best, random = None, np.random.default_rng(settings.seed)
    for k in range(SEARCHES):
        progress(0.4 + 0.2 * k, "looking for the best motion")
        point = least_point(
            lambda numbers: _score(responses.jacobian(family.tones_of(numbers)), wanted),
            family.size,
            max(1, settings.tries // SEARCHES),
            random,
        )
        found = trial.rate(family.tones_of(point))
        if found is not None and (best is None or found.score < best.score):
            best = found
    return best


@dataclass(frozen=True, eq=False)
class _Rated:
    """A motion: its values, its simulation, what a recording would tell, and half the logarithm of the determinant of
    the covariance that it would leave of the wanted parameters by noise alone."""

    values: Array
    signals: Signals
    problem: Calibrated
    jacobian: Array
    score: float

    def deviations(self) -> Array:
        """Standard deviations of the wanted parameters over those of their priors, with what the meshes have wrong."""
        J, start = self.jacobian, np.zeros(self.jacobian.shape[1])
        of_model = covariance_of_model(self.problem, start, J, np.ones(len(J)))
        variances = np.diag(np.linalg.inv(J.T @ J + np.eye(len(start))) + of_model)
        return np.sqrt(variances[_wanted(self.problem.parameters)])


def _wanted(parameters: Sequence[Parameter]) -> list[int]:
    """Those of the robot: what the model has wrong is estimated beside them, and not wanted."""
    return [k for k, p in enumerate(parameters) if p.kind in kinds.ROBOT_KINDS]


def _score(jacobian: Array, wanted: Sequence[int]) -> float:
    """Half the logarithm of the determinant of the covariance of the wanted parameters."""
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.eye(jacobian.shape[1]))[np.ix_(wanted, wanted)]
    return 0.5 * float(np.linalg.slogdet(covariance)[1])


class _Trial:
    """Rates motions."""

    def __init__(
        self, shot: CompiledShot, family: Family, parameters: Sequence[Parameter], settings: ExcitationSettings,
        options: RunSettings,
    ):  # fmt: skip
        self.shot, self.family, self.parameters, self.options = shot, family, tuple(parameters), options
        self.clearance = Clearance(shot, options)
        self._recordings = blank_recordings(settings.sensors, float(family.times[-1]) + AFTER)
        clocks = [0.0] * len(self._recordings)
        self._measurement = Measurement(
            tuple(item.file for item in self._recordings),
            sensors_of(shot.character, self._recordings, clocks, -1.0, float(family.times[-1]) + AFTER, False),
            measurement_parameters(self._recordings, clocks, settings.priors),
        )

    def problem(self, values: Array) -> Calibrated:
        """The robot and its sensors with a motion."""
        return Calibrated(
            [Take(_performing(self.shot, self.family, values), self.parameters, AFTER)], self._measurement, self.options
        )

    def rate(self, values: Array) -> _Rated | None:
        """A motion, made smaller until it keeps the limits; None where it does not, or cannot be simulated."""
        start = self.family.start
        for _ in range(TIMES):
            problem = self.problem(values)
            z = np.zeros(len(problem.lower))
            try:
                (signals,) = problem.signals(z)
                if self._kept(signals) and self.clearance.kept(problem.shot):
                    J = problem.linearized(z)[1]
                    break
            except (ShotError, SimulationFailure):
                return None
            values = start + LESS * (values - start)
        else:
            return None
        return _Rated(values, signals, problem, J, _score(J, _wanted(self.parameters)))

    def _kept(self, signals: Signals) -> bool:
        """Whether the simulated motors stay within their efforts, and their joints within their ranges."""
        character, bounds = self.shot.character, self.family.bounds
        limited = np.array([m.model != SERVO for m in character.motors])  # a servo's motor limits itself
        efforts = np.abs(signals.efforts).max(axis=0, initial=0.0)
        lower = np.array([character.joints[m.joint].lower for m in character.motors])
        upper = np.array([character.joints[m.joint].upper for m in character.motors])
        inside = (signals.angles >= lower - 1e-9) & (signals.angles <= upper + 1e-9)
        return bool(np.all(inside) and np.all(efforts[limited] <= MARGIN * bounds.effort[limited]))


def _performing(shot: CompiledShot, family: Family, values: Array) -> CompiledShot:
    """The robot of a shot with other curves."""
    tracks = tuple(Track(family.times, column) for column in values.T)
    return replace(shot, animation=Animation(family.times, tracks, tracks, shot.animation.moving))


def blank_recordings(sensors: Sequence[PlannedSensor], end: float) -> list[SensorRecording]:
    """Recordings without what they will hold, one for each kind of sensor: each has a clock of its own."""
    found = []
    for kind in dict.fromkeys(sensor.kind for sensor in sensors):
        channels = []
        for sensor in sensors:
            if sensor.kind == kind:
                times = np.arange(0.0, end, 1.0 / sensor.rate)
                channels.append(
                    Channel(kind, sensor.path, times, np.zeros((len(times), COMPONENTS[kind])), sensor.sigma)
                )
        found.append(SensorRecording(kind, "", tuple(channels)))
    return found


def _clear(shot: CompiledShot, family: Family, clearance: Clearance, rated: _Rated) -> tuple[Clear, ...]:
    least = clearance.least(_performing(shot, family, rated.values))
    return tuple(
        Clear(pair.first, pair.second, pair.apart, float(own)) for pair, own in zip(clearance.pairs, least, strict=True)
    )


def _uses(shot: CompiledShot, family: Family, rated: _Rated) -> tuple[MotorUse, ...]:
    rows = []
    for k, motor in enumerate(shot.character.motors):
        offsets = rated.values[:, k] - family.start[k]
        rate = np.gradient(offsets, family.times)
        shares = family.uses(offsets, k)[1] if np.any(offsets) else np.zeros(3)
        effort = float(np.abs(rated.signals.efforts[:, k]).max())
        rows.append(
            MotorUse(
                motor.path,
                float(np.abs(offsets).max()),
                float(np.abs(rate).max()),
                float(np.abs(np.gradient(rate, family.times)).max()),
                effort,
                float(shares[0]),
                float(shares[1]),
                float(shares[2]),
                effort / motor.max_torque if np.isfinite(motor.max_torque) else 0.0,
            )
        )
    return tuple(rows)
