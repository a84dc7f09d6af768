"""Parameters of a robot from recordings of its performance, with their standard deviations."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import RunSettings
from calmotion.multibody import IMPLICIT, SimulationFailure
from calmotion.recordings import UNITS, SensorRecording
from calmotion.simulation import MAX_STEP, CompiledShot, failure_error, prepare

from ..model.estimates import (
    CLOCK_DRIFT,
    CLOCK_OFFSET,
    ROBOT_KINDS,
    Calibration,
    ChannelCurves,
    ChannelFit,
    Estimate,
)
from .advice import IDENTIFIABLE, advised
from .measurement import Measurement, measurement_parameters, sensors_of
from .motor_groups import grouped, of_each_motor
from .parameters import DEFAULT, Parameter, robot_parameters
from .problem import Calibrated
from .recordings.clocks import clock_of
from .recordings.noise import noise_of
from .recordings.plausible import refuse_far, refuse_long, refuse_still
from .robots import robot_at, robot_with
from .search import HALVINGS, STIFF, Found, profiled, search, step_of
from .signals import Signals, ends_at_rest, refuse_cyclic, signals_of

AFTER = 1.0  # what a recording holds after the end of the shot is used up to here [s]
SCHEME = "generalized-alpha"  # a quarter of BDF2's error, and no damping to speak of
STIFFER = 30.0  # times as stiff as the shot's: a robot that hardly shakes, by which clocks are found
STRONG = 0.9  # correlation that is worth a note
MISSED, TOGETHER = 1.5, 3.0  # residuals over the noise, and samples that count as one: the model misses something


@dataclass(frozen=True)
class CalibrationSettings:
    """What to estimate, and how.

    Attributes:
        parameters: Kinds, each by itself or as `KIND:PATTERN`.
        priors: Standard deviations by kind, over `parameters.PRIORS`.
        validate: Whether a fifth of the samples is held out.
        halvings: Most halvings of the time step.
        after: What is used of a recording after the end of the shot [s].
        by_motor_type: Whether motors of one type share their parameters.
    """

    parameters: tuple[str, ...] = DEFAULT
    priors: Mapping[str, float] = field(default_factory=dict)
    validate: bool = True
    halvings: int = HALVINGS
    after: float = AFTER
    by_motor_type: bool = False


def calibrate_shot(
    shot: CompiledShot, recordings: Sequence[SensorRecording], settings: CalibrationSettings, options: RunSettings,
    progress: Callable[[float, str], None] = lambda fraction, message: None,
) -> Calibration:  # fmt: skip
    """Estimate the parameters of a robot.

    Args:
        shot: The shot that was performed, with a target at each prim that has a sensor; its current curves are those
            that the robot played.
        recordings: What was measured.
        settings: What to estimate.
        options: Step and integrator.
        progress: Called with a fraction and a message.

    Raises:
        ShotError: The shot loops or cannot be simulated, nothing is to be estimated, or a recording does not fit.
    """
    begin = time.perf_counter()
    refuse_cyclic(shot.character.retarget.cyclic, shot.character.path)
    refuse_long(recordings, float(shot.animation.frame_times[-1]))
    if not recordings:
        raise ShotError("there are no recordings", path=shot.character.path, remedy="Name one with --recording")
    parameters = robot_parameters(shot, settings.parameters, settings.priors)
    if settings.by_motor_type:
        parameters = grouped(parameters, shot.character)
    if not ends_at_rest(shot.animation):  # what a robot does that is stopped amid a motion is not known
        settings = replace(settings, after=0.0)
    options, nominal = simulable(shot, options, settings.after)
    refuse_far(shot.character, recordings, nominal)
    refuse_still(shot.character, recordings, nominal)
    progress(0.02, "finding the clocks of the recordings")
    known = CLOCK_OFFSET in settings.priors  # then time 0 is the first frame, within this standard deviation
    robots = [nominal] if known else [nominal, *_hardly_shaking(shot, parameters, options, settings.after)]
    clocks = [0.0 if known else clock_of(recording, shot.character, robots) for recording in recordings]
    first, last = (0.0 if nominal.times[0] < 0.0 else -np.inf), float(nominal.times[-1])
    measurement = Measurement(
        tuple(recording.file for recording in recordings),
        sensors_of(shot.character, recordings, clocks, max(first, -1.0), last, settings.validate),
        measurement_parameters(recordings, clocks, settings.priors),
    )
    told = _Told(progress)
    problem = Calibrated(shot, parameters, measurement, options, settings.after, told.simulated)
    found = search(problem, told, settings.halvings)
    progress(0.95, "comparing the recordings with the robot")
    before = _nominal_fit(problem, found)
    estimates = _estimates(found)
    fits, curves = _fits(found, *before, recordings)
    spreads = np.array([p.spread for p in _all(found.problem)])
    notes = tuple(_notes(found, estimates, fits, settings))
    estimates, covariance = of_each_motor(parameters, estimates, spreads[:, None] * found.covariance * spreads)
    return Calibration(
        estimates, covariance, {r.file: r.sha256 for r in recordings}, fits, curves,
        found.solution.converged, found.iterations, told.count, step_of(found.problem), found.shift,
        time.perf_counter() - begin, notes,
    )  # fmt: skip


def _hardly_shaking(
    shot: CompiledShot, parameters: Sequence[Parameter], options: RunSettings, after: float
) -> list[Signals]:
    """Signals of a robot of which all that is estimated and gives is far stiffer; none where it cannot be simulated."""
    x = np.array([np.log(STIFFER) / p.spread if p.kind in STIFF else 0.0 for p in parameters])
    if not x.any():
        return []
    try:
        return [signals_of(robot_at(shot, parameters, x), options, after)]
    except (SimulationFailure, ShotError):
        return []


class _Told:
    """Progress with the number of simulations, in the thread that began: simulations run in others as well."""

    def __init__(self, progress: Callable[[float, str], None]):
        self._progress, self._fraction, self._message, self.count = progress, 0.05, "", 0
        self._thread = threading.get_ident()

    def __call__(self, fraction: float, message: str) -> None:
        self._fraction, self._message = fraction, message
        self._progress(fraction, message)

    def simulated(self) -> None:
        """One more."""
        self.count += 1
        if threading.get_ident() == self._thread:
            self._progress(self._fraction, f"{self._message}: {self.count} simulations")


def simulable(shot: CompiledShot, options: RunSettings, after: float) -> tuple[RunSettings, Signals]:
    """Options with a step and an integrator that simulate the shot, and its signals."""
    step = options.step or shot.character.retarget.time_step or MAX_STEP
    given = options.integrator
    schemes = (given,) if given is not None else (SCHEME, "bdf2")
    for scheme in schemes:
        chosen = replace(options, step=step, integrator=scheme)
        try:
            return chosen, signals_of(robot_with(shot, {}), chosen, after)
        except (SimulationFailure, ShotError) as failure:
            if scheme == schemes[-1] or scheme not in IMPLICIT:
                if isinstance(failure, SimulationFailure):
                    raise failure_error(prepare(shot, chosen), failure) from failure
                raise
    raise AssertionError("a scheme either simulates or raises")


def _all(problem: Calibrated) -> tuple[Parameter, ...]:
    return (*problem.parameters, *problem.measurement.parameters)


def _nominal_fit(problem: Calibrated, found: Found) -> tuple[Signals, Array]:
    """Signals of the shot's own robot, and the parameters of the measurement that fit them best."""
    own = Calibrated(
        problem.shot, problem.parameters, found.problem.measurement, found.problem.options, found.problem.after
    )
    z = np.zeros_like(found.z)
    fitted, _ = profiled(own, z)
    return own.signals(z), fitted[len(problem.parameters) :]


def _estimates(found: Found) -> tuple[Estimate, ...]:
    problem, deviations = found.problem, np.sqrt(np.diag(found.covariance))
    advice = advised(problem, np.asarray(np.linalg.inv(found.covariance)), found.solution.z)
    rows = []
    for k, p in enumerate(_all(problem)):
        x, sd = float(found.z[k]), float(deviations[k])
        identifiable = sd <= IDENTIFIABLE
        text = ""
        if not identifiable and p.kind in ROBOT_KINDS:
            text = (
                f"{advice[k].sentence} narrow it to {100.0 * advice[k].sigma:.2g}% of its prior" if k in advice
                else "no single marker, accelerometer, encoder or torque would tell it from this motion"
            )  # fmt: skip
        rows.append(
            Estimate(
                p.kind,
                p.path,
                p.axis,
                p.unit,
                p.nominal,
                p.slope(0.0),
                p.value(x),
                p.slope(x) * sd,
                p.logarithmic,
                identifiable,
                text,
            )  # fmt: skip
        )
    return tuple(rows)


def _fits(
    found: Found, nominal: Signals, of_nominal: Array, recordings: Sequence[SensorRecording]
) -> tuple[tuple[ChannelFit, ...], tuple[ChannelCurves, ...]]:
    problem = found.problem
    measurement, y = problem.measurement, found.z[len(problem.parameters) :]
    signals = problem.signals(found.z)
    fits, curves = [], []
    for sensor in measurement.sensors:
        channel = sensor.channel
        after = measurement.predicted(signals, sensor, y)
        before = measurement.predicted(nominal, sensor, of_nominal)
        file, unit = recordings[sensor.recording].file, UNITS[channel.kind]
        off, fitted = channel.values - after, sensor.fitted
        fits.append(
            ChannelFit(
                file,
                channel.name,
                unit,
                int(fitted.sum()),
                int(sensor.validated.sum()),
                sensor.sigma,
                _rms((channel.values - before)[fitted]),
                _rms(off[fitted]),
                _rms(off[sensor.validated]),
                int((np.abs(off[fitted]) > 3.0 * sensor.sigma).sum()),
            )  # fmt: skip
        )
        used = sensor.used
        times = measurement.robot_times(sensor, y)[used]
        curves.append(
            ChannelCurves(
                file, channel.name, unit, times, channel.values[used], before[used], after[used], sensor.held_out[used]
            )
        )
    return tuple(fits), tuple(curves)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _notes(
    found: Found, estimates: Sequence[Estimate], fits: Sequence[ChannelFit], settings: CalibrationSettings
) -> list[str]:
    """What the user must know."""
    notes = []
    if not found.solution.converged:
        notes.append("the search did not converge: the estimates may be far from the best ones")
    if settings.halvings and found.shift > 1.0:
        notes.append("the estimates still depend on the time step: give a smaller one with --step")
    notes += _missed(found, fits)
    deviations = np.sqrt(np.diag(found.covariance))
    correlations = found.covariance / np.outer(deviations, deviations)
    robot = [k for k, item in enumerate(estimates) if item.of_robot]
    for i, k in enumerate(robot):
        for other in robot[i + 1 :]:
            if abs(correlations[k, other]) > STRONG:
                notes.append(
                    f"{estimates[k].name} and {estimates[other].name} are hard to tell apart (correlation "
                    f"{correlations[k, other]:+.2f}): what is known well is a combination of both"
                )
    for k, item in enumerate(estimates):
        if item.kind in (CLOCK_OFFSET, CLOCK_DRIFT) or abs(found.z[k]) < 4.0:
            continue
        notes.append(
            f"{item.name} is {abs(found.z[k]):.1f} standard deviations of its prior away from the shot: check the "
            f"units and axes of the recording, or give it a wider prior (--prior {item.kind}=...)"
        )
    return notes


def _missed(found: Found, fits: Sequence[ChannelFit]) -> list[str]:
    """Sensors that measured something which no robot of this kind does: more than noise is left, and not at random."""
    notes = []
    for sensor, fit in zip(found.problem.measurement.sensors, fits, strict=True):
        channel = sensor.channel
        noise = channel.sigma if channel.sigma is not None else noise_of(channel.values[sensor.used])
        if fit.rms > MISSED * noise and sensor.count > TOGETHER:
            notes.append(
                f"{channel.name} still differs by {fit.rms / noise:.2g} times its noise, and not at random: the model "
                "misses something, and the estimates may be wrong by more than their standard deviations. Try a finer "
                "model (a smaller --tolerance), or more --parameters"
            )
    return notes
