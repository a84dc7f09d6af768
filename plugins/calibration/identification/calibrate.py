"""Parameters of a robot from recordings of its performance, with their standard deviations."""

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import PRESCRIBED, SERVO, RunSettings, curve_of
from calmotion.recordings import ANGLE, STRAIN, SensorRecording, unit_of
from calmotion.simulation import CompiledShot

from ..model import kinds
from ..model.estimates import Calibration, ChannelCurves, ChannelFit, Estimate
from .advice import IDENTIFIABLE, advised
from .disagreement import misses
from .measurement import Measurement, Motions
from .motor_groups import of_each_motor
from .parameters import Parameter
from .problem import Calibrated
from .recordings.clocks import clock_of
from .recordings.plausible import refuse_long, refuse_unlike
from .recordings.sensors import Sensor, gauge_parameters, measurement_parameters, sensors_of, start_parameters
from .search import HALVINGS, Found, profiled, search, step_of
from .signals import begins_in_motion, refuse_cyclic
from .takes import Take, all_simulable, begun, hardly_shaking, takes_of

AFTER = 1.0  # what a recording holds after the end of the shot is used up to here [s]
STRONG = 0.9  # correlation that is worth a note


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

    parameters: tuple[str, ...] = kinds.DEFAULT
    priors: Mapping[str, float] = field(default_factory=dict)
    validate: bool = True
    halvings: int = HALVINGS
    after: float = AFTER
    by_motor_type: bool = False


def calibrate_shot(
    shot: CompiledShot,
    recordings: Sequence[SensorRecording],
    settings: CalibrationSettings,
    options: RunSettings,
    progress: Callable[[float, str], None] = lambda fraction, message: None,
) -> Calibration:
    """`calibrate_shots` of one shot."""
    return calibrate_shots([(shot, recordings)], settings, options, progress)


def calibrate_shots(
    performed: Sequence[tuple[CompiledShot, Sequence[SensorRecording]]],
    settings: CalibrationSettings,
    options: RunSettings,
    progress: Callable[[float, str], None] = lambda fraction, message: None,
) -> Calibration:
    """Estimate the parameters of a robot from recordings of one or several shots.

    Args:
        performed: Shots of the same robot, each with a target at each prim that has a sensor, whose current curves are
            those that the robot played, and what was measured then. Nominal values, such as gains, may differ from shot
            to shot by known factors; an estimate is that of the first shot, and has the same factor in all.
        settings: What to estimate.
        options: Step and integrator.
        progress: Called with a fraction and a message.

    Raises:
        ShotError: A shot loops or cannot be simulated, nothing is to be estimated, a recording does not fit, or the
            shots are not of one robot.
    """
    begin = time.perf_counter()
    for shot, recordings in performed:
        refuse_cyclic(shot.character.retarget.cyclic, shot.character.path)
        refuse_long(recordings, float(shot.animation.frame_times[-1]))
        if not recordings:
            raise ShotError("there are no recordings", path=shot.character.path, remedy="Name one with --recording")
    known = kinds.CLOCK_OFFSET in settings.priors  # then time 0 is the first frame, within this standard deviation
    takes, factors = takes_of(performed, settings)
    options, nominal = all_simulable(takes, options)
    all_recordings = [recording for _, recordings in performed for recording in recordings]
    sensors: list[Sensor] = []
    rows: list[Parameter] = []
    progress(0.02, "finding the clocks of the recordings")
    for k, (take, (shot, recordings)) in enumerate(zip(takes, performed, strict=True)):
        refuse_unlike(shot.character, recordings, nominal[k])
        robots = [nominal[k]] if known else [nominal[k], *hardly_shaking(take, options)]
        clocks = [0.0 if known else clock_of(recording, shot.character, robots) for recording in recordings]
        first, last = (0.0 if nominal[k].times[0] < 0.0 else -np.inf), float(nominal[k].times[-1])
        own = sensors_of(shot.character, recordings, clocks, max(first, -1.0), last, settings.validate)
        takes[k] = begun(take, own, clocks, nominal[k])
        before = sum(len(earlier) for _, earlier in performed[:k])
        sensors += [replace(sensor, take=k, recording=sensor.recording + before) for sensor in own]
        rows += measurement_parameters(recordings, clocks, settings.priors, k)
        known_as = [replace(sensor, take=k) for sensor in own]
        rows += gauge_parameters(known_as, clocks, nominal[k], settings.priors)
        begins = start_parameters(known_as, clocks, nominal[k], begins_in_motion(shot.animation))
        takes[k] = replace(takes[k], moves=bool(begins))
        rows += begins
    measurement = Measurement(tuple(recording.file for recording in all_recordings), tuple(sensors), tuple(rows))
    told = _Told(progress)
    problem = Calibrated(takes, measurement, options, told.simulated)
    found = search(problem, told, settings.halvings)
    progress(0.95, "comparing the recordings with the robot")
    nominal_fit = _nominal_fit(problem, found)
    estimates = _estimates(found)
    fits, curves = _fits(found, *nominal_fit, all_recordings)
    spreads = np.array([p.spread for p in _all(found.problem)])
    notes = tuple(_notes(found, estimates, fits, settings))
    estimates, covariance = of_each_motor(problem.parameters, estimates, spreads[:, None] * found.covariance * spreads)
    return Calibration(
        estimates, covariance, {r.file: r.sha256 for r in all_recordings}, fits, curves,
        found.solution.converged, found.iterations, told.count, step_of(found.problem), found.shift,
        time.perf_counter() - begin, notes, factors, found.interrupted,
    )  # fmt: skip


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


def _all(problem: Calibrated) -> tuple[Parameter, ...]:
    return (*problem.parameters, *problem.measurement.parameters)


def _nominal_fit(problem: Calibrated, found: Found) -> tuple[Motions, Array]:
    """Signals of the shots' own robot, and the parameters of the measurement that fit them best."""
    own = Calibrated(problem.takes, found.problem.measurement, found.problem.options)
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
        if not identifiable and p.kind in kinds.ROBOT_KINDS:
            text = (
                f"{advice[k].sentence} narrow it to {100.0 * advice[k].sigma:.2g}% of its prior"
                if k in advice
                else "no single marker, accelerometer, encoder or torque would show it in this motion"
            )
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
                identifiable and bool(found.disagrees[k]),
            )
        )
    return tuple(rows)


def _fits(
    found: Found, nominal: Motions, of_nominal: Array, recordings: Sequence[SensorRecording]
) -> tuple[tuple[ChannelFit, ...], tuple[ChannelCurves, ...]]:
    problem = found.problem
    measurement, y = problem.measurement, found.z[len(problem.parameters) :]
    signals = problem.signals(found.z)
    fits, curves = [], []
    for sensor in measurement.sensors:
        channel = sensor.channel
        after = measurement.predicted(signals, sensor, y)
        before = measurement.predicted(nominal, sensor, of_nominal)
        file = recordings[sensor.recording].file
        unit = unit_of(channel.kind, channel.path, problem.shot.character.motors)
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
                float(np.abs(off[sensor.validated if sensor.validated.any() else fitted]).max(initial=0.0)),
                _share(problem.takes[sensor.take], sensor, measurement.robot_times(sensor, y), off),
            )
        )
        used = sensor.used
        times = measurement.robot_times(sensor, y)[used]
        curves.append(
            ChannelCurves(
                file, channel.name, unit, times, channel.values[used], before[used], after[used], sensor.held_out[used]
            )
        )
    return tuple(fits), tuple(curves)


def _share(take: Take, sensor: Sensor, times: Array, off: Array) -> float:
    """The share of what an ideal robot would not show of a sensor that is left unexplained; NaN if that is unknown."""
    channel, whole = sensor.channel, sensor.fitted | sensor.validated
    if channel.kind == STRAIN:
        added = channel.values - channel.values[whole].mean()
    elif channel.kind == ANGLE and take.shot.character.motors[sensor.index].model != PRESCRIBED:  # type: ignore[index]
        command = curve_of(take.shot.animation.current[sensor.index], take.end, False)  # type: ignore[index]
        added = channel.values - command(times, 0)[:, None]
    else:
        return float("nan")
    return _rms(off[whole]) / max(_rms(added[whole]), 1e-300)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _notes(
    found: Found, estimates: Sequence[Estimate], fits: Sequence[ChannelFit], settings: CalibrationSettings
) -> list[str]:
    """What the user must know."""
    notes = []
    if found.interrupted and found.solution.converged:
        notes.append("interrupted while the step was halved: the estimates are those of the last step that converged")
    elif found.interrupted:
        notes.append("interrupted: the estimates are the best ones so far, and the search had not converged")
    elif not found.solution.converged:
        notes.append("the search did not converge: the estimates may be far from the best ones")
    if settings.halvings and found.shift > 1.0:
        notes.append("the estimates still depend on the time step: give a smaller one with --step")
    for take in found.problem.takes:
        if take.start is not None:
            notes.append(
                f"the recording of {take.shot.character.path} begins in another pose than the shot: the simulation "
                f"starts at rest, in the pose that the encoders show {take.begin:.3g} s after the first frame"
            )
        if take.moves:
            notes.append(
                f"{take.shot.character.path} moves already when its recording begins: its vibration at that time is "
                "estimated from the recording (`start`)"
            )
    notes += _missed(found, fits)
    split = [item.name for item in estimates if item.of_robot and item.disagrees]
    if split:
        notes.append(
            f"pieces of the recordings differ by more than noise in {', '.join(split)}: these values hold with this "
            "model only, and their standard deviations are those that other recordings would give"
        )
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
        if item.kind in (kinds.CLOCK_OFFSET, kinds.CLOCK_DRIFT) or abs(found.z[k]) < 4.0:
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
        left = misses(sensor, fit.rms)
        if left:
            notes.append(
                f"{sensor.channel.name} still differs by {left:.2g} times its noise, and not at random: the model "
                "misses something, and standard deviations are those that other recordings would give. Try a finer "
                "model (a smaller --tolerance), another friction of motors (calm:motor:frictionModel), or more "
                "--parameters"
            )
    smooth = [
        motor.path
        for motor in found.problem.shot.character.motors
        if motor.model == SERVO and not (motor.rotor.friction or motor.rotor.viscous_friction)
    ]
    if notes and smooth:
        notes.append(
            f"the shot has no friction of {', '.join(smooth)}, so that none is estimated: author a guess "
            "(calm:motor:friction, such as 5% of the largest torque)"
        )
    return notes
