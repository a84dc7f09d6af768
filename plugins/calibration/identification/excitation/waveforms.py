"""Test motions: sums of tones about a pose, from rest to rest, within bounds of range, velocity and acceleration."""

from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.model import Animation, Character, curve_of
from calmotion.simulation import coupling_of, leaders

TONES = 5
RAMP, LONGEST_RAMP = 0.2, 0.6  # of the length, in which the motion fades in and out, and most [s]
MARGIN = 0.95  # of what a motor may do
LOWEST, HIGHEST = 0.3, 1.5  # tones, over the lowest and over the highest frequency that is to be excited
PER_PERIOD = 6.0  # fewest frames in a period of a tone


@dataclass(frozen=True, eq=False)
class Bounds:
    """What the motors may do: those of the joint and its motor, and no more than the shot itself asks of them.

    Attributes:
        lower, upper: About the first pose [rad or m], shape [M].
        velocity, acceleration: Shape [M].
        effort: Largest one, infinite where there is none, shape [M].
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    effort: Array


def bounds_of(character: Character, animation: Animation, amplitude: float, travel: float) -> Bounds:
    """What the motors may do in a test motion about the first pose of a shot.

    A motor that the shot does not move may do what the fastest one of its kind does.

    Args:
        amplitude, travel: Largest excursion of a hinge [rad] and of a slider [m].

    Raises:
        ShotError: The first pose is outside the range of a joint, or the shot moves nothing.
    """
    end = float(animation.frame_times[-1])
    fine = np.linspace(0.0, end, 8 * len(animation.frame_times))
    curves = [curve_of(track, end, False) for track in animation.current]
    start = np.array([float(curve(np.zeros(1), 0)[0]) for curve in curves])
    speeds, accelerations = (
        np.array([float(np.abs(curve(fine, order)).max()) for curve in curves]) for order in (1, 2)
    )
    motors = character.motors
    linear = np.array([motor.linear for motor in motors], bool)
    for own in (speeds, accelerations):
        for kind in (linear, ~linear):
            if np.any(kind):
                own[kind & (own <= 1e-6 * own[kind].max())] = own[kind].max()
    if np.any((speeds <= 0.0) | (accelerations <= 0.0)):
        still = next(m.path for m, speed in zip(motors, speeds, strict=True) if speed <= 0.0)
        raise ShotError(
            "the shot moves no motor of this kind, so that it does not say how fast a test motion may be",
            path=still,
            attribute="calm:motor:maxVelocity",
            found="no motion",
            remedy="Name a shot in which the robot moves as fast as it may",
        )
    joints = [character.joints[motor.joint] for motor in motors]
    most = np.where(linear, travel, amplitude)
    below = np.array([min(a, q - joint.lower) for a, q, joint in zip(most, start, joints, strict=True)])
    above = np.array([min(a, joint.upper - q) for a, q, joint in zip(most, start, joints, strict=True)])
    for motor, q, low, high, joint in zip(motors, start, below, above, joints, strict=True):
        if low < 0.0 or high < 0.0:
            raise ShotError(
                "the first pose is outside the range of this joint",
                path=motor.path,
                attribute="physics:lowerLimit",
                found=f"{q:.4g}, where the range is {joint.lower:.4g} to {joint.upper:.4g}",
                remedy="Correct the limits, or the first frame of the shot",
            )
    return Bounds(
        -below,
        above,
        np.minimum(speeds, [m.max_velocity for m in motors]),
        np.minimum(accelerations, [m.max_acceleration for m in motors]),
        np.array([m.max_torque for m in motors], float),
    )


@dataclass(frozen=True, eq=False)
class Family:
    """Test motions of one length.

    Attributes:
        times: Frames [s], shape [f].
        start: The pose [rad or m], shape [M].
        leading: Motors that move on their own.
        coupling: Of all motors with these, shape [M, m].
        tones: Frequencies [Hz], shape [K].
        bounds: What the motors may do.
    """

    times: Array
    start: Array
    leading: IntArray
    coupling: Array
    tones: Array
    bounds: Bounds

    @property
    def size(self) -> int:
        """Number of numbers that describe a motion: level and phase of each tone of each leading motor."""
        return 2 * len(self.leading) * len(self.tones)

    def tones_of(self, numbers: Array) -> Array:
        """The motion of a point of the family [rad or m], shape [f, M]."""
        levels, phases = numbers.reshape(2, len(self.leading), len(self.tones))
        waves = np.cos(2.0 * np.pi * self.times[:, None, None] * self.tones + phases)
        return self.within(np.einsum("fmk,mk->fm", waves, np.exp(levels) / self.tones))

    def chirp(self) -> Array:
        """A motion of equal length whose frequency grows from the lowest to the highest tone; the motors a quarter of a
        period behind one another."""
        end = self.times[-1]
        swept = self.tones[0] * self.times + 0.5 * (self.tones[-1] - self.tones[0]) * self.times**2 / end
        phases = 0.5 * np.pi * np.arange(len(self.leading))
        return self.within(np.sin(2.0 * np.pi * swept[:, None] + phases))

    def within(self, waves: Array) -> Array:
        """Waves of the leading motors, shape [f, m], faded in and out, as large as the bounds allow, in all motors."""
        end = self.times[-1]
        ramp = min(RAMP * end, LONGEST_RAMP)
        s = np.clip(np.minimum(self.times, end - self.times) / ramp, 0.0, 1.0)
        return self._allowed(waves * (s**3 * (10.0 - 15.0 * s + 6.0 * s**2))[:, None])

    def pulse(self, leader: int, frame: int, shape: Array, share: float) -> tuple[Array, float]:
        """A motion in which a leading motor leaves the pose for some frames.

        Args:
            leader: Index among the leading motors.
            frame: In the middle.
            shape: The excursion, 1 at the most, at an odd number of frames.
            share: Of what the bounds allow.

        Returns:
            The motion, shape [f, M], and its largest excursion [rad or m], 0 where the motor may not move.
        """
        motor, before, found = self.leading[leader], len(shape) // 2, []
        for sign in (1.0, -1.0):
            waves = np.zeros((len(self.times), len(self.leading)))
            waves[frame - before : frame + before + 1, leader] = sign * shape
            offsets = share * (self._allowed(waves) - self.start)
            found.append((self.start + offsets, float(offsets[frame, motor])))
        return max(found, key=lambda item: abs(item[1]))

    def _allowed(self, moved: Array) -> Array:
        """Waves of the leading motors, shape [f, m], as large as the bounds allow, in all motors."""
        own = np.stack([self._scaled(moved[:, k], int(motor)) for k, motor in enumerate(self.leading)], axis=1)
        offsets = own @ self.coupling.T
        largest = max(
            (self.uses(offsets[:, k], k)[0] for k in range(len(self.start)) if np.any(offsets[:, k])), default=1.0
        )
        return np.asarray(self.start + offsets / max(largest, 1.0))

    def _scaled(self, wave: Array, motor: int) -> Array:
        used = self.uses(wave, motor)[0]
        return np.asarray(wave * (MARGIN / used)) if np.isfinite(used) and used > 0.0 else np.zeros_like(wave)

    def uses(self, offsets: Array, motor: int) -> tuple[float, Array]:
        """The largest share of what a motor may do that an excursion uses, and those of range, velocity and
        acceleration; infinite where it may not move."""
        bounds = self.bounds
        rate = np.gradient(offsets, self.times)
        bend = np.gradient(rate, self.times)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.array(
                [
                    np.nanmax([offsets.max() / bounds.upper[motor], offsets.min() / bounds.lower[motor], 0.0]),
                    np.abs(rate).max() / bounds.velocity[motor],
                    np.abs(bend).max() / bounds.acceleration[motor],
                ]
            )
        return float(shares.max()), shares


def family_of(character: Character, animation: Animation, frequencies: Array, bounds: Bounds, length: float) -> Family:
    """Test motions of a robot, from the first pose of its shot.

    Args:
        frequencies: Natural ones that are to be excited [Hz]; none: those that the shot itself would have.
        bounds: What the motors may do.
        length: [s].

    Raises:
        ShotError: No motor may move, or the frames are too few.
    """
    frame = float(animation.frame_times[1] - animation.frame_times[0])
    times = frame * np.arange(round(length / frame) + 1)
    leading = leaders(character)
    if not len(leading) or len(times) < 4 * PER_PERIOD:
        raise ShotError(
            "no motor may move" if not len(leading) else "the test motion has too few frames",
            path=character.path,
            attribute="calm:motor:optimize" if not len(leading) else "--duration",
            found=f"{len(leading)} motors and {len(times)} frames",
            remedy="Set calm:motor:optimize to true on some motors, or take a longer --duration",
        )
    wanted = np.asarray(frequencies)[np.asarray(frequencies) > 0.0]
    most = 1.0 / (PER_PERIOD * frame)
    low = max(2.0 / times[-1], LOWEST * float(wanted.min(initial=2.0)))
    high = min(most, HIGHEST * float(wanted.max(initial=1.0)))
    low = min(low, 0.5 * high)
    start = np.array(
        [float(curve_of(t, float(animation.frame_times[-1]), False)(np.zeros(1), 0)[0]) for t in animation.current]
    )
    return Family(
        np.asarray(times, np.float64),
        start,
        leading,
        coupling_of(character, leading),
        np.geomspace(low, high, TONES),
        bounds,
    )
