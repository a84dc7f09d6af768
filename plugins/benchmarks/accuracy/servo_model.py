"""The model of a servo by other authors: a pendulum on a motor with the laws of friction M1 to M6.

The package `better-actuator-models` has the model, its published parameters and the simulator. The simulator takes
arrays, so that all recordings, each with all changes of one parameter, are simulated at once.

Source: Duclusaud, Passault, Padois, Ly, Extended Friction Models for the Physics Simulation of Servo Actuators,
arXiv 2410.08650.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from calmotion import ShotError
from calmotion.arrays import Array
from scipy.optimize import least_squares

FIT_STEP, STEP = 2e-3, 1e-3  # of the simulator, in a fit and in a replay [s]
OUTLIER = 0.05  # from which a residual counts by its size, not by its square [rad]
CHANGE = 1e-3  # of a parameter, for derivatives, of its range


@dataclass(frozen=True)
class Bench:
    """A servo that swings a weight.

    Attributes:
        motor, model: Names of the package, `xl330` and `m6`.
        mass, arm_mass: Of the weight and of the rod that carries it [kg].
        length: Of the rod [m].
        volts: Of the supply.
        unit_gain: Position gain of a shot whose firmware has a gain of 1 [N m/rad].
    """

    motor: str
    model: str
    mass: float
    arm_mass: float
    length: float
    volts: float
    unit_gain: float


@dataclass(frozen=True, eq=False)
class Played:
    """Commands of a shot, and what was measured of them.

    Attributes:
        gain: Of the firmware.
        times, commands: [s], [rad], shape [n] each; an angle of 0 hangs down.
        measured_times, angles: [s], [rad], shape [m] each.
    """

    gain: float
    times: Array
    commands: Array
    measured_times: Array
    angles: Array


@dataclass(frozen=True)
class FittedServo:
    """The model with parameters that explain recordings best.

    Attributes:
        parameters: By name, in the units of the package.
        error: Mean absolute error on the recordings [rad].
        published_error: The same with the published parameters.
    """

    parameters: dict[str, float]
    error: float
    published_error: float
    bench: Bench = field(repr=False)

    def largest_error_mm(self, gain: float, times: Array, commands: Array, aim: Array) -> float:
        """Largest distance of the weight from its place at the angles `aim` [mm].

        Args:
            gain: Of the firmware.
            times, commands, aim: [s], [rad], [rad], shape [n] each.
        """
        fine = np.arange(times[0], times[-1], STEP)
        played = Played(gain, times, commands, fine, fine)
        angles = _angles(self.bench, self.parameters, [played], STEP, commands[:1])[0]
        turned = angles - np.interp(fine, times, aim)
        return float(2e3 * self.bench.length * np.abs(np.sin(0.5 * turned)).max())


def _model(bench: Bench) -> tuple[Any, type[Any]]:
    """The published model, and the simulator's class.

    Raises:
        ShotError: The package is missing.
    """
    try:
        from bam.model import load_model
        from bam.simulate import Simulator
    except ImportError as error:
        raise ShotError(
            "the model of the servo is not installed", found=str(error),
            remedy="Install it with Python 3.12: pip install better-actuator-models",
        ) from None  # fmt: skip
    return load_model(motor_name=bench.motor, model=bench.model), Simulator


def _angles(
    bench: Bench, parameters: dict[str, Any], plays: Sequence[Played], step: float, start: Array
) -> list[Array]:
    """Angles of the model at the times of the measurements [rad], shape [m] or, with columns of parameters, [m, k].

    Args:
        parameters: Numbers, or arrays of shape [k].
        plays: That are simulated at once.
        step: Of the simulator [s].
        start: Angles at the start, at rest [rad], shape [number of plays].
    """
    model, simulator = _model(bench)
    for name, value in parameters.items():
        getattr(model, name).value = value
    rows = (len(plays), 1)
    actuator = model.actuator
    actuator.load_log({"mass": bench.mass, "arm_mass": bench.arm_mass, "length": bench.length, "vin": bench.volts,
                       "kp": np.reshape([play.gain for play in plays], rows)})  # fmt: skip
    width = max(np.size(value) for value in parameters.values())
    run = simulator(model)
    run.reset(np.repeat(start[:, None], width, axis=1), np.zeros((len(plays), width)))
    end = max(max(play.times[-1], play.measured_times[-1]) for play in plays)
    times = np.arange(plays[0].times[0], end + 2 * step, step)
    goals = np.stack([np.interp(times, play.times, play.commands) for play in plays])
    found = np.empty((len(times), *run.q.shape))
    base = np.broadcast_to(model.friction_base.value, run.q.shape)
    for k in range(len(times)):
        found[k] = run.q
        model.friction_base.value = base.copy()  # a step adds its friction to it
        run.step(actuator.compute_control(goals[:, k : k + 1], run.q, run.dq, step), True, step)
    at = [
        np.stack([np.interp(play.measured_times, times, found[:, row, c]) for c in range(width)], axis=1)
        for row, play in enumerate(plays)
    ]
    return [values[:, 0] for values in at] if width == 1 else at


def fitted_servo(bench: Bench, plays: Sequence[Played]) -> FittedServo:
    """All parameters of the model, fitted to recordings from the published ones, within the package's bounds.

    Raises:
        ShotError: The package is missing.
    """
    known = _model(bench)[0].get_parameters()
    names = [name for name, parameter in known.items() if parameter.optimize]
    low, high = (np.array([getattr(known[name], end) for name in names]) for end in ("min", "max"))
    published = np.array([known[name].value for name in names])
    start, measured = np.array([play.angles[0] for play in plays]), np.concatenate([play.angles for play in plays])

    def off(points: Array) -> Array:
        """Residuals [rad] at parameters of shape [p, k], shape [n, k]."""
        values = dict(zip(names, points, strict=True))
        at = _angles(bench, values, plays, FIT_STEP, start)
        found: Array = np.concatenate([np.reshape(own, (len(own), -1)) for own in at]) - measured[:, None]
        return found

    def slopes(x: Array) -> Array:
        sides = np.where(x + CHANGE * (high - low) <= high, 1.0, -1.0) * CHANGE * (high - low)
        both = off(np.concatenate([x[:, None], x[:, None] + np.diag(sides)], axis=1))
        return np.asarray((both[:, 1:] - both[:, :1]) / sides)

    inner = np.clip(published, low + 1e-6 * (high - low), high - 1e-6 * (high - low))
    found = least_squares(
        lambda x: off(x[:, None])[:, 0], inner, slopes, bounds=(low, high), x_scale="jac",
        loss="soft_l1", f_scale=OUTLIER, max_nfev=40,
    )  # fmt: skip
    before, after = (float(np.abs(off(x[:, None])).mean()) for x in (published, found.x))
    return FittedServo(dict(zip(names, map(float, found.x), strict=True)), after, before, bench)
