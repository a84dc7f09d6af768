"""A test motion that makes parameters of a robot identifiable."""

from dataclasses import dataclass

from calmotion.arrays import Array


@dataclass(frozen=True)
class PlannedSensor:
    """A sensor that will record the test motion.

    Attributes:
        kind: Of its channel, see `recording`.
        path: Prim path of its prim or joint.
        sigma: Standard deviation of its noise, in the unit of the channel.
        rate: Samples in a second [Hz].
    """

    kind: str
    path: str
    sigma: float
    rate: float


@dataclass(frozen=True)
class Predicted:
    """Standard deviations of a parameter, in the unit of its value.

    Attributes:
        name, kind, path, unit: As of `estimates.Estimate`.
        nominal: Value in the shot.
        prior: Before any recording.
        excited: After a recording of the test motion.
        chirp: After one of a chirp of equal length within the same limits.
        identifiable: Whether the test motion tells it.
    """

    name: str
    kind: str
    path: str
    unit: str
    nominal: float
    prior: float
    excited: float
    chirp: float
    identifiable: bool


@dataclass(frozen=True)
class MotorUse:
    """How far the test motion uses what a motor may do.

    Attributes:
        path: Of its joint.
        excursion: Largest distance from the first pose [rad or m].
        velocity, acceleration: Largest ones of the curve [rad/s, rad/s^2, or with m].
        effort: Largest one in the simulation [N m or N].
        range_share, velocity_share, acceleration_share, effort_share: Of what the motor may do; 0 without a bound.
    """

    path: str
    excursion: float
    velocity: float
    acceleration: float
    effort: float
    range_share: float
    velocity_share: float
    acceleration_share: float
    effort_share: float


@dataclass(frozen=True)
class Clear:
    """Two bodies that no joint connects.

    Attributes:
        first, second: Their paths.
        apart: Their distance in the first pose, at least [m].
        least: The smallest one in the test motion, at least [m].
    """

    first: str
    second: str
    apart: float
    least: float


@dataclass(frozen=True, eq=False)
class Excitation:
    """A test motion.

    Attributes:
        times: Of its frames [s], shape [f].
        values: Of the motors [rad or m], shape [f, M].
        predicted: Standard deviations of the parameters of the robot.
        motors: What the motors do in it.
        sensors: By which it will be recorded.
        information: Gain over the chirp: half the logarithm of the determinant of the covariance, less.
        evaluations: Number of motions that were compared.
        wall_s: Time it took [s].
        clear: Bodies that stay apart.
        together: Paths of pairs of bodies that no joint connects, and that are not known to stay apart: they touch in
            the first pose, or almost.
    """

    times: Array
    values: Array
    predicted: tuple[Predicted, ...]
    motors: tuple[MotorUse, ...]
    sensors: tuple[PlannedSensor, ...]
    information: float
    evaluations: int
    wall_s: float
    clear: tuple[Clear, ...] = ()
    together: tuple[tuple[str, str], ...] = ()
