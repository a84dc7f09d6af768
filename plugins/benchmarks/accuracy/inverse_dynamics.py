"""Classic identification of a rigid arm: efforts of its motors by linear least squares, without any simulation.

Positions of the joints give the motion of each link, and its splines the derivatives. The moments of all links that a
joint carries, about the joint at p, are linear in their masses m, first moments s = m c and inertias J about origins o:

    F = m (o'' - g) + (R s)'',    M = (o - p) x F + R s x (o'' - g) + (R J R^T w)'

and so are the rotor's inertia, viscous and Coulomb friction, and an offset, also of rotors that two joints turn. What
the data do not tell stays zero (truncated singular values: the base parameters).

Source: Khalil, Dombre, Modeling, Identification and Control of Robots, 2002, chapter 12; Gautier, Khalil, Direct
calculation of minimum set of inertial parameters of serial robots, 1990.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.model import PRESCRIBED, Character, curve_of, rotor_angles
from calmotion.recordings import EFFORT, Channel, SensorRecording
from calmotion.simulation import CompiledShot
from calmotion.support import rotation_from_quaternion
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

RATE = 400.0  # of the samples of the motion [Hz]
INERTIAS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))  # entries of J
OF_BODY, OF_ROTOR = 10, 4  # columns of each
TOLD = 1e-4  # least singular value over the largest one, of columns of unit size


@dataclass(frozen=True, eq=False)
class Moved:
    """Efforts of a motion as linear functions of an arm's parameters, and as they were recorded.

    Attributes:
        rows: [T, M, 10 B + 4 M]: of each body m, s, J; of each motor inertia, viscous and Coulomb friction, offset.
        times: [s], shape [T].
        efforts: What was recorded of some motors.
    """

    rows: Array
    times: Array
    efforts: tuple[tuple[int, Channel], ...] = ()

    def at(self, motor: int, times: Array) -> Array:
        """The rows of a motor at times [s], shape [n, 10 B + 4 M]."""
        return np.asarray(make_interp_spline(self.times, self.rows[:, motor], k=1)(times))

    def off(self, parameters: Array) -> list[Array]:
        """How far the recordings are from what parameters make of the motion, of each motor [N m]."""
        return [channel.values[:, 0] - self.at(motor, channel.times) @ parameters for motor, channel in self.efforts]


def serves(character: Character) -> bool:
    """Whether a character is a rigid tree whose joints are ideal motors of hinges, or fixed."""
    driven = {motor.joint for motor in character.motors if motor.model == PRESCRIBED and motor.follows is None}
    kinds = [joint.kind == ("revolute" if k in driven else "fixed") for k, joint in enumerate(character.joints)]
    # in the order of the bodies that they carry
    tree = [joint.body1 == k and joint.body0 < k for k, joint in enumerate(character.joints)]
    return (
        len(kinds) == len(character.bodies)
        and all(kinds)
        and all(tree)
        and not any(body.simulated_flexible for body in character.bodies)
    )


def moved(shot: CompiledShot, recordings: Sequence[SensorRecording] = ()) -> Moved:
    """The motion that a shot's curves ask for, with the efforts among its recordings, whose clocks begin with it."""
    character, animation = shot.character, shot.animation
    end = float(animation.frame_times[-1])
    times = np.linspace(0.0, end, int(RATE * end) + 1)
    motors = {motor.joint: k for k, motor in enumerate(character.motors)}
    values = {joint: curve_of(animation.current[k], end, False)(times, 0) for joint, k in motors.items()}
    turned, origins = list[Array](), list[Array]()  # of the bodies
    places, axes = list[Array](), list[Array]()  # of the joints
    for k, joint in enumerate(character.joints):
        first, last = rotation_from_quaternion(joint.frame0.rotation), rotation_from_quaternion(joint.frame1.rotation)
        R, o = (np.eye(3), np.zeros(3)) if joint.body0 < 0 else (turned[joint.body0], origins[joint.body0])
        about = Rotation.from_rotvec(values.get(k, 0.0 * times)[:, None] * np.array([0.0, 0.0, 1.0])).as_matrix()
        own = R @ first @ about @ last.T
        place = o + (R @ joint.frame0.position).reshape(-1, 3)
        turned.append(own)
        origins.append(place - own @ joint.frame1.position)
        places.append(place)
        axes.append((R @ first)[..., 2] * np.ones((len(times), 1)))
    rows = np.zeros((len(times), len(values), OF_BODY * len(character.bodies) + OF_ROTOR * len(values)))
    for b in range(len(character.bodies)):
        wrench = _wrenches(times, turned[b], origins[b], np.asarray(character.gravity, float))
        carrier = b
        while carrier >= 0:
            force, moment = wrench[..., :3], wrench[..., 3:]
            about = moment + np.cross((origins[b] - places[carrier])[:, None], force)
            if carrier in motors:
                along = np.einsum("tki,ti->tk", about, axes[carrier])
                rows[:, motors[carrier], OF_BODY * b : OF_BODY * (b + 1)] = along
            carrier = character.joints[carrier].body0
    bodies = OF_BODY * len(character.bodies)
    for k, motor in enumerate(character.motors):
        if motor.turns_with is not None:  # its effort acts on the other joint as well
            rows[:, motor.turns_with.other] -= motor.turns_with.ratio * rows[:, k]
    rotors = rotor_angles(character.motors, np.stack([values[m.joint] for m in character.motors], axis=1))
    for k, motor in enumerate(character.motors):
        spline = make_interp_spline(times, rotors[:, k], k=5)
        speed, faster = spline.derivative(1)(times), spline.derivative(2)(times)
        of_rotor = np.stack([faster, speed, np.tanh(speed / motor.rotor.friction_speed), np.ones(len(times))], axis=1)
        rows[:, k, bodies + OF_ROTOR * k : bodies + OF_ROTOR * (k + 1)] = of_rotor
    index = {motor.path: k for k, motor in enumerate(character.motors)}
    efforts = list[tuple[int, Channel]]()
    for channel in [own for recording in recordings for own in recording.channels if own.kind == EFFORT]:
        known = (channel.times >= 0.0) & (channel.times <= end) & np.isfinite(channel.values[:, 0])
        efforts.append(
            (index[channel.path], replace(channel, times=channel.times[known], values=channel.values[known]))
        )
    return Moved(rows, times, tuple(efforts))


def _wrenches(times: Array, R: Array, o: Array, gravity: Array) -> Array:
    """Forces and moments about a body's origin that its motion takes, for each of its parameters at 1, shape
    [T, 10, 6]."""

    def by_time(values: Array, order: int) -> Array:
        return np.asarray(make_interp_spline(times, values, k=5).derivative(order)(times))

    found = np.zeros((len(times), OF_BODY, 6))
    fall = by_time(o, 2) - gravity
    found[:, 0, :3] = fall
    spin = by_time(R, 1) @ np.swapaxes(R, 1, 2)
    w = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    bent = by_time(R, 2)
    for i in range(3):
        found[:, 1 + i, :3] = bent[:, :, i]
        found[:, 1 + i, 3:] = np.cross(R[:, :, i], fall)
    for k, (i, j) in enumerate(INERTIAS):
        J = np.zeros((3, 3))
        J[i, j] = J[j, i] = 1.0
        momentum = np.einsum("tab,bc,tdc,td->ta", R, J, R, w)
        found[:, 4 + k, 3:] = by_time(momentum, 1)
    return found


def nominal(character: Character) -> Array:
    """Parameters of the bodies as the shot has them, those of rotors zero, shape [10 B + 4 M]."""
    found = list[list[float]]()
    for body in character.bodies:
        assert body.mass is not None
        m, c = body.mass.mass, body.mass.center
        J = body.mass.inertia + m * (c @ c * np.eye(3) - np.outer(c, c))
        found.append([m, *(m * c), *(J[i, j] for i, j in INERTIAS)])
    return np.concatenate([np.ravel(found), np.zeros(OF_ROTOR * len(character.motors))])


def identified(character: Character, taken: Sequence[Moved], bodies: bool) -> Array:
    """Parameters that explain efforts best, each motor's errors weighed alike: those of rotors, or of bodies as well.

    Args:
        bodies: Whether masses are identified too.
    """
    own = nominal(character)
    free = np.arange(len(own)) >= (0 if bodies else OF_BODY * len(character.bodies))
    rows, values = [], []
    for motion in taken:
        for (motor, channel), off in zip(motion.efforts, motion.off(own), strict=True):
            size = channel.values.std()
            rows.append(motion.at(motor, channel.times)[:, free] / size)
            values.append(off / size)
    A, b = np.concatenate(rows), np.concatenate(values)
    size = np.maximum(np.linalg.norm(A, axis=0), 1e-12)
    own[free] += np.linalg.lstsq(A / size, b, rcond=TOLD)[0] / size
    return own
