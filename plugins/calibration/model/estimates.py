"""Parameters of a robot as they were estimated from recordings."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array, BoolArray

from .kinds import ROBOT_KINDS

AXES = "xyz"
WITH_THIS_MODEL_ONLY = "with this model only"


@dataclass(frozen=True)
class Estimate:
    """A parameter as it was estimated.

    Attributes:
        kind: One of `ROBOT_KINDS`, `MODEL_KINDS` or `MEASUREMENT_KINDS`.
        path: Prim path of the material, body, joint or sensor; the file of a recording for its clock.
        axis: Component, -1 where it is a number.
        unit: Of the value, SI.
        nominal: Value in the shot; mean of the prior.
        prior: Standard deviation of the prior, in the unit of the value.
        value: Estimated value.
        standard_deviation: Of the value.
        logarithmic: Whether its logarithm has a normal distribution.
        identifiable: Whether the recordings tell more about it than the prior.
        disagrees: Whether pieces of the recordings tell other values, by more than noise: another model would have
            another value, and the standard deviation is that of what other recordings tell.
        advice: A measurement that would tell it, as a sentence; empty where it is identifiable or none would.
    """

    kind: str
    path: str
    axis: int
    unit: str
    nominal: float
    prior: float
    value: float
    standard_deviation: float
    logarithmic: bool
    identifiable: bool
    advice: str = ""
    disagrees: bool = False

    @property
    def name(self) -> str:
        """Kind, path and component: `modulus /Arm/Nylon`, `centre /Arm/Hand.x`."""
        return f"{self.kind} {self.path}" + (f".{AXES[self.axis]}" if self.axis >= 0 else "")

    @property
    def of_robot(self) -> bool:
        """Whether it belongs to the robot, not to its model or a measurement."""
        return self.kind in ROBOT_KINDS


@dataclass(frozen=True)
class ChannelFit:
    """How well the model predicts a channel.

    Attributes:
        recording: File of its recording.
        name: Of the channel.
        unit: Of the values.
        samples, held_out: Number of values that were fitted, and of those that were not.
        sigma: Standard deviation of the noise that was assumed in the end.
        rms_before: Root mean square of the residuals with the parameters of the shot, clocks fitted.
        rms, validation_rms: With the estimated ones, over fitted and over held-out values; NaN where there are none.
        outliers: Number of fitted values with less than full weight.
        largest: Residual of the held-out values, of the fitted ones where none were held out.
        share: Of what links and motors that give add to the motion of an ideal robot, that is not explained: root mean
            square of the residuals, fitted and held-out, over that of the signal less an ideal robot's; NaN of a
            channel that does not tell.
    """

    recording: str
    name: str
    unit: str
    samples: int
    held_out: int
    sigma: float
    rms_before: float
    rms: float
    validation_rms: float
    outliers: int
    largest: float = float("nan")
    share: float = float("nan")


@dataclass(frozen=True, eq=False)
class ChannelCurves:
    """Measured and predicted values of a channel, for figures.

    Attributes:
        recording, name, unit: As of `ChannelFit`.
        times: Of the robot's clock [s], shape [n].
        measured, before, after: Shape [n, c].
        held_out: Which samples were not fitted, shape [n].
    """

    recording: str
    name: str
    unit: str
    times: Array
    measured: Array
    before: Array
    after: Array
    held_out: BoolArray


@dataclass(frozen=True, eq=False)
class Calibration:
    """Parameters of a robot from recordings.

    Attributes:
        estimates: Of all parameters.
        covariance: Of their values; of the logarithms of those that are logarithmic; shape [n, n].
        recordings: SHA-256 by the file of the recording.
        channels: How well the model predicts each channel.
        curves: For figures.
        converged: Whether the search ended at a minimum.
        iterations, simulations: Of the search.
        step_s: Time step of the last simulations [s].
        step_shift: Largest change of an estimate by the last halving of the step, over its standard deviation.
        wall_s: Time it took [s].
        notes: What the user must know, as sentences.
        interrupted: Whether the step was not halved as far as it should, since the user stopped the search.
        gain_factors: Motors whose position gains differ from shot to shot; the estimate is that of the first shot.
    """

    estimates: tuple[Estimate, ...]
    covariance: Array
    recordings: Mapping[str, str]
    channels: tuple[ChannelFit, ...]
    curves: tuple[ChannelCurves, ...]
    converged: bool
    iterations: int
    simulations: int
    step_s: float
    step_shift: float
    wall_s: float
    notes: tuple[str, ...] = ()
    gain_factors: tuple[str, ...] = ()
    interrupted: bool = False

    @property
    def correlations(self) -> Array:
        """Of the parameters, shape [n, n]."""
        scale = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))
        return np.asarray(self.covariance / np.outer(scale, scale))

    def estimate(self, name: str) -> Estimate:
        """The estimate of a name."""
        return next(item for item in self.estimates if item.name == name)


@dataclass(frozen=True)
class CalibrationFigures:
    """Paths of the figures of a calibration."""

    paths: tuple[str, ...]
