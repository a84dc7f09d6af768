"""What the sensors of a simulated robot would measure: its motion and efforts as functions of the robot's time."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.model import PRESCRIBED, Animation, Character, Rotor, RunSettings, curve_of, rotor_angles
from calmotion.multibody import (
    NOWHERE,
    Model,
    Reason,
    SimulationFailure,
    Workspace,
    equilibrium,
    joint_values,
    natural_modes,
    reactions,
    rigid_state,
    rotor_efforts,
    start_angles,
)
from calmotion.recordings import ACCELEROMETER, ANGLE, EFFORT, MARKER, STRAIN, Channel, LowPass
from calmotion.simulation import AT_REST, CompiledShot, ForwardRun, Prepared, over_grid, prepare, run_forward
from calmotion.support import rotation_from_quaternion
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.signal import bilinear, lfilter, lfilter_zi
from scipy.spatial.transform import Rotation

from .robots import Robot

MOVES = 0.05  # share of its largest speed from which a command moves at the first frame, beyond what a spline rings
FREE_MODES = 2  # lowest, in which a robot may move already when a shot begins
Place = int | tuple[int, int]  # index of a target or of a motor; of the two targets of a strain gauge
_TURNS, _NEAR = 20, 1e-5  # of the search for the command of a pose, and its end [rad or m]


@dataclass(frozen=True, eq=False)
class Signals:
    """The motion of a simulated robot; before it begins and after it ends it stands still.

    Attributes:
        times: Of the robot's clock [s], the first frame at 0, shape [T].
        positions: Of the targets [m], world, shape [T, K, 3].
        rotations: Rotation matrices of the targets, shape [T, K, 3, 3].
        angles: Of the motors' joints [rad or m], shape [T, M].
        efforts: Of the motors on their rotors [N m or N], those of ideal motors included, shape [T, M].
        loads: The same without the rotors of ideal motors.
        gravity: [m/s^2], world, shape [3].
        offsets: Of the motors' encoders [rad or m], shape [M].
        modes: Frequencies [Hz] and damping ratios of the lowest natural modes where it begins, shape [2, n].
        divided: Parts into which steps of the simulation were divided, shape [T].
    """

    times: Array
    positions: Array
    rotations: Array
    angles: Array
    efforts: Array
    loads: Array
    gravity: Array
    offsets: Array
    modes: Array = field(default_factory=lambda: np.zeros((2, 0)))
    divided: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    _splines: dict[object, CubicSpline] = field(default_factory=dict, repr=False)

    @cached_property
    def specific_forces(self) -> Array:
        """R^T (a - g) of each target in its axes [m/s^2], shape [T, K, 3]."""
        accelerations = make_interp_spline(self.times, self.positions, k=5).derivative(2)(self.times)
        return np.asarray(np.einsum("tkij,tki->tkj", self.rotations, accelerations - self.gravity))

    def at(self, kind: str, index: Place, times: Array, order: int = 0, low_pass: LowPass | None = None) -> Array:
        """A quantity at times of the robot's clock, shape [n, c], or its derivative by time.

        Args:
            kind: Of a channel.
            index: Of the target, or of the motor; of both targets of a strain gauge.
            times: [s], shape [n].
            order: 0, or 1 for the derivative, which is zero where the robot stands still.
            low_pass: What the sensor does to it.
        """
        return self._sampled((kind, index, low_pass), times, order)

    def decays(self, times: Array, order: int = 0) -> Array:
        """Free motions in each of the lowest modes from the first frame on, of size one, which begin with a deflection
        and with a speed, or their derivatives by time, shape [n, 2 modes]."""
        frequencies, damping = self.modes
        rate = 2.0 * np.pi * frequencies * (1j * np.sqrt(np.maximum(1.0 - damping**2, 0.0)) - damping)
        moving = rate**order * np.exp(rate * np.maximum(times, 0.0)[:, None])
        moving[times < 0.0] *= float(order == 0)
        return np.asarray(np.stack([moving.real, moving.imag], axis=2).reshape(len(times), -1))

    def axes_at(self, index: int, times: Array, order: int = 0) -> Array:
        """Rotation matrices of a target, shape [n, 3, 3]."""
        return self._sampled(("axes", index, None), times, order).reshape(-1, 3, 3)

    def _sampled(self, key: tuple[str, Place, LowPass | None], times: Array, order: int) -> Array:
        if key not in self._splines:
            kind, index, low_pass = key
            self._splines[key] = CubicSpline(self.times, self._filtered(self._values(kind, index), low_pass))
        inside = np.clip(times, self.times[0], self.times[-1])
        values = np.asarray(self._splines[key](inside, order), np.float64)
        moving = (inside == times)[:, None] | (order == 0)
        return np.asarray(np.where(moving, values, 0.0), np.float64)

    def _filtered(self, values: Array, low_pass: LowPass | None) -> Array:
        """Values behind a filter, which has settled when the robot begins to move."""
        if low_pass is None:
            return values
        w = 2.0 * np.pi * low_pass.frequency
        second = low_pass.damping is not None
        poles = [1.0, 2.0 * float(low_pass.damping or 0.0) * w, w * w] if second else [1.0, w]
        b, a = bilinear([poles[-1]], poles, 1.0 / float(self.times[1] - self.times[0]))
        return np.asarray(lfilter(b, a, values, axis=0, zi=lfilter_zi(b, a)[:, None] * values[:1])[0])

    def _bending(self, first: int, last: int) -> Array:
        """Curvature of a link between two targets [1/m], shape [T, 1], about the axis across their line about which it
        bends most: the strain of a surface is in proportion, which on a thin link no displacement tells."""
        between = Rotation.from_matrix(np.swapaxes(self.rotations[:, first], 1, 2) @ self.rotations[:, last])
        turned = (between[0].inv() * between).as_rotvec()
        along = self.rotations[0, last].T @ (self.positions[0, last] - self.positions[0, first])
        length = float(np.linalg.norm(along))
        turned = turned - np.outer(turned @ along, along) / length**2
        axis = np.linalg.svd(turned, full_matrices=False)[2][0]
        sign = np.sign(axis[np.argmax(np.abs(axis))])
        return np.asarray((turned @ axis * sign / length)[:, None])

    def _values(self, kind: str, index: Place) -> Array:
        if isinstance(index, tuple):
            return self._bending(*index)
        if kind == MARKER:
            return self.positions[:, index]
        if kind == ACCELEROMETER:
            return self.specific_forces[:, index]
        if kind == ANGLE:  # what the encoder reads
            return np.asarray(self.angles[:, index, None] + self.offsets[index], np.float64)
        if kind == EFFORT:
            return self.efforts[:, index, None]
        return self.rotations[:, index].reshape(-1, 9)


def place_of(channel: Channel, character: Character) -> Place | None:
    """Where a channel sits: the index of its target or motor, or those of both ends; None where the robot lacks it."""
    if channel.kind in (ANGLE, EFFORT):
        return {motor.path: k for k, motor in enumerate(character.motors)}.get(channel.path)
    targets = {target.path: k for k, target in enumerate(character.targets)}
    first, last = targets.get(channel.path), targets.get(channel.to)
    return first if channel.kind != STRAIN or first is None else None if last is None else (first, last)


def signals_of(
    robot: Robot, options: RunSettings, after: float = 0.0, start: Array | None = None, begin: float = 0.0,
    divided: IntArray | None = None,
) -> Signals:  # fmt: skip
    """Simulate a robot in its shot, and for some time after its end [s], in which the motors hold.

    Steps in which the friction of a servo turns are divided: without that, signals jump as parameters change.

    Args:
        robot: The robot.
        options: With step and integrator.
        after: [s].
        start: Where the joints of the motors stand up to a time [rad or m], shape [M], NaN where their commands say it.
        begin: That time [s].
        divided: Parts into which steps are divided: those of signals that hardly differ; None: as needed.

    Raises:
        ShotError: The shot cannot be simulated.
        SimulationFailure: A step fails.
    """
    prepared = prepare(_lengthened(robot, after), options)
    model, grid = prepared.model, prepared.grid
    angles, rates = _commands(robot, prepared)
    workspace = Workspace.for_system(model.system)
    if start is not None:
        angles = _begun(robot, prepared, workspace, angles, start, begin)
    divided = np.zeros(len(angles), np.int64) if divided is None else divided
    run = run_forward(
        model, workspace, angles, rates, grid.h, prepared.world, integrator=options.scheme, divided=divided
    )
    return with_rotors(_measured(robot, prepared, run), robot)


def _measured(robot: Robot, prepared: Prepared, run: ForwardRun) -> Signals:
    model, character = prepared.model, prepared.character
    found = reactions(model.system, run.trajectory, run.joint_angles, run.joint_rates)
    values = model.turned(
        joint_values(model.system, model.motor, character.motors, run.trajectory.states.u, run.joint_angles)
    )
    rotations = run.target_rotations
    lost = np.flatnonzero(~np.isfinite(rotations).all(axis=(1, 2)))
    if len(lost):  # a body that is bent so far that its frame at the target has no direction
        raise SimulationFailure(float(prepared.grid.times[lost[0]]), NOWHERE, Reason.DIVERGED)
    loads = model.motor_efforts(found.efforts)
    return Signals(
        prepared.grid.times, run.target_positions, rotation_from_quaternion(rotations),
        model.motor_values(values), loads, loads, np.asarray(character.gravity, float),
        robot.offsets, _modes(model, run.commands[0]), run.trajectory.divided,
    )  # fmt: skip


def with_rotors(signals: Signals, robot: Robot) -> Signals:
    """The same motion with efforts on the rotors of a robot's ideal motors, which no simulation has to know."""
    motors, efforts = robot.shot.character.motors, signals.loads.copy()
    turned = rotor_angles(motors, signals.angles)
    for k, motor in enumerate(motors):
        if motor.model == PRESCRIBED and motor.follows is None and motor.rotor != Rotor():
            efforts[:, k] = rotor_efforts(motor.rotor, signals.times, turned[:, k], efforts[:, k])
    return replace(signals, efforts=efforts, _splines={})


def _modes(model: Model, commands: Array) -> Array:
    """Of the lowest modes that oscillate; none where the robot has no equilibrium."""
    try:
        found = np.stack(natural_modes(model, commands))
    except (np.linalg.LinAlgError, SimulationFailure):
        return np.zeros((2, 0))
    return found[:, (found[0] > 0.0) & (found[1] < 1.0)][:, :FREE_MODES]


def _begun(robot: Robot, prepared: Prepared, workspace: Workspace, angles: Array, start: Array, begin: float) -> Array:
    """Commands under which the robot stands at given angles until a time, where it is let go to its own commands.

    A real joint that stands is held by friction, which the static start does not have.
    """
    model, motors = prepared.model, prepared.character.motors
    free = np.isfinite(start) & np.array([motor.model != PRESCRIBED for motor in motors])
    command, slope = angles[0].copy(), np.ones(len(start))
    moved, before = np.zeros(len(start)), np.zeros(len(start))
    for _ in range(_TURNS):
        joints = model.joint_angles(command[None])
        state, _ = equilibrium(model.system, rigid_state(model, start_angles(model, joints[0])), joints[0], workspace)
        found = model.turned(joint_values(model.system, model.motor, motors, state.u[None], joints))
        off = np.where(free, start - robot.offsets - model.motor_values(found)[0], 0.0)
        if np.all(np.abs(off) <= _NEAR):
            break
        if np.any(moved):
            changed = np.abs(moved) > _NEAR
            slope[changed] = np.clip((before - off)[changed] / moved[changed], 0.1, 2.0)
        moved, before = off / slope, off
        command = command + moved
    held = (prepared.grid.times <= begin)[:, None] & free
    return np.asarray(np.where(held, command, angles))


def ends_at_rest(animation: Animation) -> bool:
    """Whether the current curves end at rest, so that what a robot does afterwards is known."""
    return _rests(animation, -1)


def begins_in_motion(animation: Animation) -> bool:
    """Whether the current curves move already at the first frame, where a simulation begins at rest."""
    return not _rests(animation, 0, MOVES)


def _rests(animation: Animation, instant: int, share: float = AT_REST) -> bool:
    end = float(animation.frame_times[-1])
    fine = np.linspace(0.0, end, 4 * len(animation.frame_times))
    rates = [np.abs(curve_of(track, end, False)(fine, 1)) for track in animation.current]
    fastest = max((float(rate.max()) for rate in rates), default=0.0)
    return all(float(rate[instant]) <= share * fastest for rate in rates)


def refuse_cyclic(cyclic: bool, path: str) -> None:
    """Refuse a shot that loops: a recording of it begins from rest somewhere.

    Raises:
        ShotError: It loops.
    """
    if cyclic:
        raise ShotError(
            "a recording of a shot that loops cannot be used yet",
            path=path,
            attribute="calm:retarget:cyclic",
            found=True,
            remedy="Set it to false, and record the motion once, from rest",
        )


def _lengthened(robot: Robot, after: float) -> CompiledShot:
    """The shot with more frames behind its end."""
    shot = robot.shot
    frames = shot.animation.frame_times
    more = int(np.ceil(after / (frames[1] - frames[0]) - 1e-9))
    longer = np.concatenate([frames, frames[-1] + (frames[1] - frames[0]) * np.arange(1, more + 1)])
    return replace(shot, animation=replace(shot.animation, frame_times=longer))


def _commands(robot: Robot, prepared: Prepared) -> tuple[Array, Array]:
    """What the motors' curves ask for, shape [T, M] each: those of the shot up to its end, as they are played."""
    animation, grid = robot.shot.animation, prepared.grid
    end = float(animation.frame_times[-1])
    columns = [over_grid(grid, curve_of(track, end, False)) for track in animation.current]
    if not columns:
        none = np.zeros((len(grid.times), 0))
        return none, none
    angles, rates = (np.stack([column[k] for column in columns], axis=1) for k in range(2))
    return angles - robot.offsets, rates
