"""A stream that is calmed while it is played, in comparison with input shapers.

`calmotion bench live [SHOT ...]` plays the motion of each shot, or with `--random` moves between random poses, as a
stream at 250 Hz with several look-aheads (shares of the longest period), and simulates the whole robot with the
commands. Errors are root mean squares over all targets against the intended motion with the sag of each pose, delayed
by what is known beforehand: the look-ahead, and for shapers and filters the delay that suits each best on the robot of
the model. `best` has errors with the delay that suits best on the robot that is simulated. `frequencies` scales those
of that robot: what is calmed knows the robot as it should be. Random moves are streamed with 0.4 of the period alone.
With `--mujoco` the robot has rigid bodies, and MuJoCo plays the commands. Ticks are timed in processor time of their
own thread, since others may use the machine; another thread renews the gains.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from calmotion.arrays import Array
from calmotion.model import RunSettings, Track
from calmotion.simulation import CompiledShot, Curves, TimeGrid, compile_shot, modes_of, prepare, shaped
from calmotion_plugins.live import Live, LiveSettings, Trial
from scipy.interpolate import CubicSpline
from scipy.signal import butter, fftconvolve, sosfilt

from ..common.reporting import bench_parser, finish, keep, say
from ..common.shots import SAMPLES, load
from .commands import giving_shot
from .lumped_robot import MUJOCO_STEP, simulate_lumped

RATE = 250.0  # of the stream [Hz]
SHARES = (0.1, 0.2, 0.4, 0.8)  # of the longest period, as look-ahead
SHARE = 0.4  # the one that is compared
FREQUENCIES = (1.0, 0.9, 1.1)  # the robot of the model is the first
UNCERTAIN = (0.0, 0.1)  # shares of the frequencies, with that look-ahead
CUTOFF = 0.5  # of the low-pass filter, over the lowest frequency
Left = tuple[float, Array]  # a delay, and distances of targets
KINDS = ("zv", "zvd", "ei", "mzv", "zv2", "zvd2", "ei2", "mzv2")
FILTERS = ("gaussian", "low-pass")


@dataclass(frozen=True)
class Row:
    """One method on one robot.

    Attributes:
        shot, method: Names.
        frequencies: Of the simulated robot, over those of the model.
        delay_s: [s].
        rms_mm, largest_mm: Error at the targets [mm].
        best_mm: Root mean square with the delay that suits the method best on this robot [mm].
        tick_ms, tick_99_ms: Processor time of a tick: half and 99% of them are faster [ms]; zero of shapers.
        limited_percent: Share of ticks in which the motor that is most often at a limit is.
    """

    shot: str
    method: str
    frequencies: float
    delay_s: float
    rms_mm: float
    largest_mm: float
    best_mm: float
    tick_ms: float = 0.0
    tick_99_ms: float = 0.0
    limited_percent: float = 0.0


def compare(
    name: str,
    shot: CompiledShot,
    frequencies: tuple[float, ...] = FREQUENCIES,
    shares: tuple[float, ...] = SHARES,
    mujoco: bool = False,
) -> Iterator[Row]:
    """All methods on one robot; the first of the frequencies are those of the model."""
    prepared = prepare(shot, RunSettings())
    grid, modes = prepared.grid, modes_of(prepared)
    trial = Trial(prepared)
    curves, longest = trial.curves, 1.0 / modes[0][0]
    asked = {f"live, {share:g} of the period": LiveSettings(RATE, share * longest) for share in shares}
    for share in UNCERTAIN if len(shares) > 1 else ():
        asked[f"live, {share:.0%} uncertain"] = LiveSettings(RATE, SHARE * longest, uncertainty=share)
    streams, delays = [], {"as animated": 0.0}
    for method, settings in asked.items():
        ticks = _ticks(shot, settings, CubicSpline(grid.times, curves.angles))
        streams.append((method, *trial.streamed(shot, settings), ticks))
    for factor in frequencies:
        robot = Trial(prepared, factor)

        def left(angles: Array, rates: Array, delay: float | None, robot: Trial = robot) -> tuple[Left, Left]:
            """With a delay, and with the one that suits best."""
            if mujoco:
                played = simulate_lumped(shot.character, grid.times, angles, 5.0 * MUJOCO_STEP).target_positions
            else:
                played = robot.played(angles, rates)
            best: Left = robot.compared(played, None)
            return best if delay is None else robot.compared(played, delay), best

        for method in ("as animated", *KINDS, *FILTERS):
            made: tuple[Array, Array] = _other(method, curves, grid, modes)
            late, best = left(*made, delays.get(method))
            delays.setdefault(method, late[0])
            yield _row(name, method, factor, late, best)
        for method, angles, rates, report, ticks in streams:
            limited = report["limited"].values()
            share_limited = 100.0 * max(limited, default=0) / report["ticks"]
            half, most = 1e3 * np.quantile(ticks, [0.5, 0.99])
            row = _row(name, method, factor, *left(angles, rates, report["latency_s"]))
            yield replace(row, tick_ms=half, tick_99_ms=most, limited_percent=share_limited)


def with_random_moves(shot: CompiledShot, seconds: float, seed: int = 0) -> CompiledShot:
    """The robot on moves of half a second and more between poses within 0.4 rad (0.1 m) of the first one.

    Speeds and accelerations stay within 80% of the limits of the motors.

    Args:
        seconds: Of the whole, with a second of rest at its end.
    """
    random, motors, joints = np.random.default_rng(seed), shot.character.motors, shot.character.joints
    times = np.arange(round(seconds * RATE) + 1) / RATE
    start = np.array([float(np.interp(0.0, track.times, track.values)) for track in shot.animation.current])
    reach = np.array([0.1 if joints[motor.joint].kind == "prismatic" else 0.4 for motor in motors])
    lower = np.maximum(start - reach, [joints[motor.joint].lower for motor in motors])
    upper = np.minimum(start + reach, [joints[motor.joint].upper for motor in motors])
    fastest = np.array([0.8 * motor.max_velocity for motor in motors])
    hardest = np.array([0.8 * motor.max_acceleration for motor in motors])
    values, at, pose = np.tile(start, (len(times), 1)), 0.2, start
    while at < seconds - 2.0:
        length = random.uniform(0.5, 1.0)
        # of the fifth order: at most 15/8 of the mean speed, and 10/sqrt(3) of way over time squared
        most = np.minimum(fastest * length * 8.0 / 15.0, hardest * length**2 * np.sqrt(3.0) / 10.0)
        to = pose + np.clip(random.uniform(lower, upper) - pose, -most, most)
        s = np.clip((times - at) / length, 0.0, 1.0)[:, None]
        values += (to - pose) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        at, pose = at + length + random.uniform(0.0, 0.3), to
    for k, motor in enumerate(motors):
        if motor.follows is not None:
            values[:, k] = motor.follows.offset + motor.follows.ratio * values[:, motor.follows.leader]
    tracks, frames = tuple(Track(times, column) for column in values.T), times[:: round(RATE / 25.0)]
    animation = replace(shot.animation, frame_times=frames, tracks=tracks, current=tracks)
    return compile_shot(shot.character, animation, shot.bodies)


def _ticks(shot: CompiledShot, settings: LiveSettings, motion: Callable[[float], Array], most: int = 5000) -> Array:
    """Processor time of the thread of the ticks, shape [N] [s]; another one renews the gains."""
    end = float(shot.animation.frame_times[-1])
    count, found = min(round(end * settings.rate), most), []
    with Live(shot, settings) as live:
        for k in range(count):
            sample = motion(k * live.tick_s)
            begin = time.thread_time()
            live.step(k * live.tick_s, sample)
            found.append(time.thread_time() - begin)
    return np.array(found)


def _other(method: str, curves: Curves, grid: TimeGrid, modes: tuple[Array, Array]) -> tuple[Array, Array]:
    """Angles and rates of a shaper, or of a filter that knows no later sample."""
    if method == "as animated":
        return curves.angles, curves.rates
    if method in KINDS:
        made: Curves = shaped(curves, grid, method, *modes)
        return made.angles, made.rates
    lowest, first = float(modes[0][0]), curves.angles[0]
    if method == "low-pass":
        sections = butter(2, CUTOFF * lowest, fs=1.0 / grid.h, output="sos")
        angles = first + sosfilt(sections, curves.angles - first, axis=0)
    else:
        # as late as `live`
        reach = max(round(SHARE / lowest / grid.h), 1)
        kernel = np.exp(-0.5 * (2.5 * np.arange(-reach, reach + 1) / reach) ** 2)[:, None]
        angles = first + fftconvolve(curves.angles - first, kernel / kernel.sum(), axes=0)[: len(grid.times)]
    return angles, np.gradient(angles, grid.h, axis=0)


def _row(shot: str, method: str, frequencies: float, left: Left, best: Left) -> Row:
    late, distances = left
    rms, least = (1e3 * float(np.sqrt(np.mean(found**2))) for _, found in (left, best))
    return Row(shot, method, frequencies, late, rms, 1e3 * float(distances.max()), least)


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("live", __doc__, SAMPLES)
    parser.add_argument("--random", metavar="S", type=float, help="moves between random poses for so many seconds")
    parser.add_argument("--mujoco", action="store_true", help="rigid bodies on compliant motors, played by MuJoCo")
    options = parser.parse_args(arguments)
    rows: list[Row] = []
    for path in options.shots:
        shot = giving_shot(path, None) if options.mujoco else load(path)
        if options.random:
            shot = with_random_moves(shot, options.random)
        shares = (SHARE,) if options.random else SHARES
        rows += compare(Path(path).stem, shot, FREQUENCIES[: 1 if options.mujoco else 3], shares, options.mujoco)
        say(f"{path} is done")
        keep(options, Row, rows)
    finish(options, "Streams and shapers", rows)
    return 0
