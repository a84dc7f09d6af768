"""From a compiled shot and recordings to a `Situation`."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import ON_ERROR, PRESCRIBED, Motor
from calmotion.multibody import SimulationFailure
from calmotion.recordings import ACCELEROMETER, ANGLE, EFFORT, MARKER, STRAIN, Channel, SensorRecording, unit_of
from calmotion.simulation import CompiledShot
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.signal import butter, sosfiltfilt

from .guessing import with_guessed_loops
from .mechanics import Mechanics, command_of, flexible_robot, mechanics_of
from .signals import Joint, Sensor, noise_of, on_grid
from .situation import CLOSED, Situation

STEP, COARSE = 1e-3, 4  # of the grid [s], and of the mechanics in steps of the grid
FASTEST = 15.0  # up to which encoders tell accelerations [Hz]
LONGEST = 30.0  # part of a recording that is diagnosed [s]
LEAST_SAMPLES = 50
COMPARED = (ANGLE, MARKER, ACCELEROMETER)
TOLD_BY = {
    EFFORT: "calmotion calibrate estimates gains and friction with efforts",
    STRAIN: "calmotion calibrate estimates the links' stiffness and damping with strain",
}
AHEAD = 0.015  # from which on a recording that is ahead of its command is on another clock [s]
SHIFTED = 0.3  # from which on the clocks of command and recording are taken to differ [s]
BEGINNING, ZERO = 0.1, 0.2  # [s], and what an encoder may be off there without having another zero [rad]
CLEAR = 0.03  # largest mean square of what then is left, of the variance of the command
SAME = 0.15  # difference of what was sent from the shot, of the range of its motion, up to which it is the same motion


def situation_of(
    shot: CompiledShot | None, recordings: Sequence[SensorRecording], commands: SensorRecording | None = None
) -> Situation:
    """What was commanded and recorded.

    Args:
        shot: The robot and its intended motion; None where only signals are known.
        recordings: Of one performance, on the clock of the commands, which begins with the first frame.
        commands: Values of joints as they were sent, on the same clock.

    Raises:
        ShotError: The recordings do not fit the shot, or are too short.
    """
    refuse_incomparable(recordings)
    channels = [c for recording in recordings for c in recording.channels if c.kind in COMPARED]
    if shot is None and commands is None:
        paths = [c.path for c in channels if c.kind == ANGLE]
    else:
        paths = [m.path for m in shot.character.motors] if shot else [c.path for c in _angles(commands)]
    others = sorted({c.kind for recording in recordings for c in recording.channels} - {*COMPARED})
    notes = [f"channels of kind {kind} are not used: {TOLD_BY[kind]}" for kind in others]
    end = min(max(float(c.times[-1]) for c in channels), LONGEST) if channels else 0.0
    times = np.asarray(STEP * np.arange(max(int(end / STEP) + 1, 2)), float)
    command, sent = _commands(shot, commands, paths, times, notes)
    if not command.size:
        command = np.zeros((len(times), 0))
    sensors = _sensors(shot, channels, paths, end, notes)
    motors = shot.character.motors if shot is not None else (None,) * len(paths)
    situation = Situation(STEP, command, sent, command, (), sensors, None, None, False, tuple(notes))
    situation = _on_one_clock(_along(situation, shot, paths, motors, command))
    if shot is not None and situation.mechanics is None and situation.encoders:
        # where targets should be is not known
        kept = tuple(s for s in situation.sensors if s.kind == ANGLE)
        unused = tuple(f"{s.name} is not used, for the same reason" for s in situation.sensors if s.kind != ANGLE)
        situation = replace(situation, sensors=kept, notes=(*situation.notes, *unused))
    if situation.mechanics is None or shot is None:
        return with_guessed_loops(situation)
    # along what the encoders show, so that each joint bears what the motion of the others does to it
    situation = with_guessed_loops(_along(situation, shot, paths, motors, _measured(situation)))
    if len(situation.encoders) < len(paths):
        # other joints move as those of a healthy robot do, which lag behind the command
        seen = np.array([m in situation.encoders for m in range(len(paths))])
        guessed = situation.joints
        situation = _along(situation, shot, paths, motors, np.where(seen, situation.near, situation.motion[0]))
        joints = tuple(
            replace(own, gain=g.gain, damping=g.damping, guessed=True, load=own.load if g.load.any() else g.load)
            if g.guessed
            else own
            for own, g in zip(situation.joints, guessed, strict=True)
        )
        situation = replace(situation, joints=joints)
    if not any(body.flexible for body in shot.character.bodies):
        return situation
    gains, dampings = situation.finite(situation.healthy)
    try:
        return replace(situation, flexible=flexible_robot(shot, times, situation.near, gains, dampings))
    except SimulationFailure:
        told = "the links have no equilibrium in a pose of the motion: their modes are not used"
        return replace(situation, notes=(*situation.notes, told))


def refuse_incomparable(recordings: Sequence[SensorRecording]) -> None:
    """Refuse recordings of which nothing tells how the robot moved.

    Raises:
        ShotError: They are such.
    """
    kinds = sorted({c.kind for recording in recordings for c in recording.channels})
    if not any(kind in COMPARED for kind in kinds):
        raise ShotError(
            "the recording has no joint, marker or accelerometer: nothing in it says how the robot moved",
            path=recordings[0].file,
            found=", ".join(kinds),
            remedy=f"Record joints (JOINT.angle) beside it; {TOLD_BY[kinds[0]]}",
        )


def _along(
    situation: Situation, shot: CompiledShot | None, paths: Sequence[str], motors: Sequence[Motor | None], near: Array
) -> Situation:
    """The situation with the mechanics of the rigid robot along a motion, shape [T, M]."""
    times, notes = situation.times, situation.notes
    mechanics = None
    if shot is not None and len(paths):
        mechanics = mechanics_of(shot, times[::COARSE], near[::COARSE])
        if mechanics is None:
            notes = (*notes, CLOSED)
    joints = tuple(
        _joint(path, m, motor, mechanics, times, near[:, m])
        for m, (path, motor) in enumerate(zip(paths, motors, strict=True))
    )
    return replace(situation, near=near, joints=joints, mechanics=mechanics, known=mechanics is not None, notes=notes)


def _angles(recording: SensorRecording | None) -> list[Channel]:
    return [c for c in recording.channels if c.kind == ANGLE] if recording is not None else []


def _joint(path: str, m: int, motor: Motor | None, mechanics: Mechanics | None, times: Array, command: Array) -> Joint:
    if mechanics is None or motor is None:
        # without inertias, the torque that presses teeth together goes with the acceleration
        one, none = np.ones(len(times)), np.zeros(len(times))
        step = times[1] - times[0]
        return Joint(path, one, none, np.gradient(np.gradient(command, step), step), none)
    inertia, torque, slope = (
        on_grid(times, mechanics.times, getattr(mechanics, name)[:, m]) for name in ("inertia", "torque", "slope")
    )
    # both by the same differences, so that noise of encoders, twice differentiated, is not left over as a load
    few, own = mechanics.times, on_grid(mechanics.times, times, command)
    acceleration = np.gradient(np.gradient(own, few, edge_order=2), few, edge_order=2)
    load = on_grid(times, few, mechanics.torque[:, m] - mechanics.inertia[:, m] * acceleration)
    rotor = motor.rotor
    if motor.model == PRESCRIBED:  # gains of a drive that this shot does not use
        return Joint(path, inertia + rotor.armature, load, torque, slope, delay=motor.delay)
    return Joint(
        path, inertia + rotor.armature, load, torque, slope, motor.position_gain,
        motor.velocity_gain + rotor.viscous_friction + rotor.back_emf,
        float(motor.damping_on == ON_ERROR) * motor.velocity_gain
        / max(motor.velocity_gain + rotor.viscous_friction + rotor.back_emf, 1e-300),
        motor.delay,
    )  # fmt: skip


def _commands(
    shot: CompiledShot | None, commands: SensorRecording | None, paths: Sequence[str], times: Array, notes: list[str]
) -> tuple[Array, Array | None]:
    """The intended motion, and what was sent where that differs, shape [T, M] each."""
    planned = command_of(shot, times) if shot is not None else None
    if commands is None:
        if planned is None:
            notes.append("no commands are known: only the signals themselves are looked at")
            return np.zeros((len(times), len(paths))), None
        return planned, None
    logged = {c.path: c for c in _angles(commands)}
    unknown = [path for path in logged if path not in paths]
    if unknown or not logged:
        raise ShotError(
            "the commands name joints that the robot does not have" if unknown else "the commands have no joint",
            path=commands.file,
            found=unknown[0] if unknown else None,
            remedy=f"Name columns JOINT.angle, with a joint of {', '.join(paths[:6])}",
        )
    sent, clean = (planned.copy() if planned is not None else np.zeros((len(times), len(paths))) for _ in range(2))
    for m, path in enumerate(paths):
        if path in logged:
            sent[:, m], clean[:, m] = _held_and_clean(logged[path], times)
    if planned is not None:
        spread = max(float(np.std(planned)), 1e-9)
        if float(np.sqrt(np.mean((sent - planned) ** 2))) < SAME * spread:
            clean = planned
        else:
            notes.append("what was sent is not the motion of the shot: it is taken as the intended one")
    jump = np.abs(sent - clean).max(initial=0.0)
    return clean, sent if jump > 1e-3 else None


def _held_and_clean(channel: Channel, times: Array) -> tuple[Array, Array]:
    """A log of commands as the driver holds them, and as a smooth curve through those that are new."""
    t, values = channel.times, channel.values[:, 0]
    period = float(np.median(np.diff(t)))
    # what is held lags by half a period, which is no fault
    at = np.clip(np.searchsorted(t, times + 0.5 * period, side="right") - 1, 0, len(t) - 1)
    late = np.diff(t, prepend=t[0] - period) > 1.8 * period
    same = np.concatenate([[False], np.diff(values) == 0.0])
    moving = np.abs(np.gradient(values)) > 0.05 * np.abs(np.gradient(values)).max(initial=0.0)
    stale = same & moving
    if not (late.any() or stale.any()):
        smooth = np.interp(times, t, values)
        return smooth, smooth
    keep = ~stale
    if stale.sum() < 0.3 * len(t):
        # a jump after a gap or a repeated value is a command that should have come between
        return values[at], PchipInterpolator(t[keep], values[keep], extrapolate=False)(
            np.clip(times, t[keep][0], t[keep][-1])
        )
    return values[at], CubicSpline(t[keep], values[keep])(np.clip(times, t[keep][0], t[keep][-1]))


def _sensors(
    shot: CompiledShot | None, channels: Sequence[Channel], paths: Sequence[str], end: float, notes: list[str]
) -> tuple[Sensor, ...]:
    """The channels with the robot's motors and targets."""
    targets = [t.path for t in shot.character.targets] if shot is not None else []
    found = []
    for channel in channels:
        names = paths if channel.kind == ANGLE else targets
        there = np.flatnonzero(np.isfinite(channel.values).any(axis=0))
        rows = np.isfinite(channel.values[:, there]).all(axis=1) & (channel.times >= 0.0) & (channel.times <= end)
        if rows.sum() < LEAST_SAMPLES:
            notes.append(f"{channel.name} has {int(rows.sum())} samples during the motion, and is not used")
            continue
        times, values = channel.times[rows], channel.values[rows][:, there]
        noise = channel.sigma if channel.sigma is not None else noise_of(channel.kind, values)
        stale = _stale(channel.kind, times, values)
        if stale:
            notes.append(stale.format(channel.name))
        times, values, noise = _thinned(times, values, noise)
        index = list(names).index(channel.path) if channel.path in names else -1
        unit = unit_of(channel.kind, channel.path, shot.character.motors if shot is not None else ())
        columns = tuple(map(int, there))
        found.append(Sensor(channel.kind, channel.path, index, times, values, max(noise, 1e-12), unit, columns))
    if not found:
        raise ShotError(
            "no channel of the recordings can be compared with the motion",
            path="--recording",
            remedy="Record at least a second of the motion, on a clock that begins with its first frame",
        )
    return tuple(found)


def _stale(kind: str, times: Array, values: Array) -> str:
    """A sentence about samples of the recording itself that repeat or are missing; empty where all is well."""
    steps = np.diff(times)
    gaps = int(np.count_nonzero(steps > 3.0 * np.median(steps)))
    same = (np.diff(values, axis=0) == 0.0).all(axis=1)
    repeated = int(np.count_nonzero(same)) if kind == ACCELEROMETER else 0
    if gaps:
        return f"{{}} itself has {gaps} gaps, the longest {1e3 * float(steps.max()):.0f} ms: its logger lost samples"
    if repeated > 0.02 * len(values):
        return f"{{}} itself repeats {repeated} of its {len(values)} samples: it is read faster than it measures"
    return ""


def _thinned(times: Array, values: Array, noise: float) -> tuple[Array, Array, float]:
    """Means of neighbouring samples, of a sensor that is much faster than the grid can follow."""
    group = int(0.0012 / max(float(np.median(np.diff(times))), 1e-9))
    if group < 2:
        return times, values, noise
    count = len(times) // group
    own = values[: count * group].reshape(count, group, -1).mean(axis=1)
    return times[: count * group].reshape(count, group).mean(axis=1), own, noise / np.sqrt(group)


def _on_one_clock(situation: Situation) -> Situation:
    """The situation with sensors moved in time where encoders follow a healthy robot much later or earlier, or are
    ahead of the command."""
    shift, times = _shift(situation, situation.motion[0]), situation.times
    if abs(shift) < SHIFTED:
        shift = min(_shift(situation, situation.command), 0.0)
    if shift > -AHEAD and abs(shift) < SHIFTED:
        return situation
    told = f"the recording follows the command by {shift:.2f} s, which is taken as a difference of their clocks"
    kept = []
    for s in situation.sensors:
        own = s.times - shift
        rows = (own >= 0.0) & (own <= times[-1])
        kept.append(replace(s, times=own[rows], values=s.values[rows]))
    return replace(situation, sensors=tuple(kept), notes=(*situation.notes, told))


def _shift(situation: Situation, motion: Array) -> float:
    """By how much encoders follow a motion, shape [T, M], later than it is [s]; 0 where that is not clear."""
    shifts = []
    for m, k in situation.encoders.items():
        if np.ptp(situation.command[:, m]) < 1e-3:
            continue
        sensor = situation.sensors[k]
        grid = np.arange(sensor.times[0], sensor.times[-1], 0.01)
        measured = np.interp(grid, sensor.times, sensor.values[:, 0])
        asked = np.interp(grid, situation.times, motion[:, m])
        lags = np.arange(-300, 301)
        cost = [_difference(measured, asked, int(lag)) for lag in lags]
        # a robot that follows badly seems to be early or late, too
        clear = min(cost) < min(CLEAR * float(np.var(asked)), 0.25 * cost[len(lags) // 2])
        shifts.append(0.01 * float(lags[int(np.argmin(cost))]) if clear else 0.0)
    return float(np.median(shifts)) if shifts else 0.0


def _measured(situation: Situation) -> Array:
    """The motion that encoders show, without what is too fast for their resolution, and the command of other joints,
    shape [T, M]."""
    near = situation.command.copy()
    for m, k in situation.encoders.items():
        sensor, own = situation.sensors[k], situation.command[:, m]
        off = sensor.values[:, 0] - np.interp(sensor.times, situation.times, own)
        # a zero that is elsewhere shows at the beginning; later a joint may be far from its command by its own faults
        first = float(np.median(off[sensor.times <= sensor.times[0] + BEGINNING]))
        off = np.interp(situation.times, sensor.times, off - (first if abs(first) > ZERO else 0.0))
        near[:, m] = own + sosfiltfilt(butter(2, FASTEST, fs=1.0 / situation.h, output="sos"), off)
    return near


def _difference(measured: Array, asked: Array, lag: int) -> float:
    """Mean square of a signal less another one that is late by some samples."""
    n = len(asked) - abs(lag)
    if n < 0.5 * len(asked):
        return np.inf
    own, other = (measured[lag:], asked[:n]) if lag >= 0 else (measured[:n], asked[-lag:])
    return float(np.var(own - other))
