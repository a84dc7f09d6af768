"""What slower motors cost in time, and in error: `optimize --retime` against one tempo for the whole, and TOPP-RA.

`calmotion bench tempo SHOT ...` gives each motor of a shot limits of speed, acceleration or effort that are a share of
what the animation needs, and finds tempo and curves. Added times are compared with the lower bound of the rigid robot,
with what TOPP-RA adds (where the package `toppra` is there; it knows no efforts), and with one tempo for the whole.
Limits are checked on fine samples of the curves, efforts in a simulation by Newmark's scheme and a quarter of the
step. The command fails where a limit is exceeded by more than a thousandth, or the error is above the tolerance and
was not at full tempo.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Character, Result, RunSettings, TempoSettings, commanded_curves, tolerance_of
from calmotion.retargeting import find_tempo, optimize_with_tempo, tempo_input
from calmotion.simulation import CompiledShot, simulate_shot
from calmotion.tolerance import found_tracks

from ..common.reporting import bench_parser, finish, keep, say
from ..common.shots import SAMPLES, load

ORDERS = {"velocity": 1, "acceleration": 2}  # which derivative of a curve each is
QUANTITIES = (*ORDERS, "effort")
SHARES = (0.8, 0.6, 0.4)
SLOWEST = 10.0  # largest stretch
EXCEEDED = 1e-3  # of a limit
FINE = 20_000  # samples of a curve
INSTANTS = 480  # of TOPP-RA in a second
NO_LIMIT = 1e6  # [1/s], of the rate of the tempo: TOPP-RA takes no infinite one
LEAST = 1e-3  # of the largest limit of all motors, that one has at least


@dataclass(frozen=True)
class Row:
    """One shot with limits.

    Attributes:
        shot, quantity, share: Which, and what is limited to which share of what the animation needs.
        lower_bound_s, toppra_s, added_s, uniform_s: Added times [s]; NaN where one is not known.
        full_tempo_mm, before_mm, after_mm: Largest error of curves that are optimised without limits at full tempo, of
            the retimed animation, and of the curves found [mm]; NaN where nothing was searched.
        tolerance_mm: [mm].
        excess: Of a limit, as a share of it; negative where all are kept.
        full_tempo_cpu_s, cpu_s: Processor time of both searches [s].
    """

    shot: str
    quantity: str
    share: float
    lower_bound_s: float
    toppra_s: float
    added_s: float
    uniform_s: float
    full_tempo_mm: float = np.nan
    before_mm: float = np.nan
    after_mm: float = np.nan
    tolerance_mm: float = np.nan
    excess: float = np.nan
    full_tempo_cpu_s: float = np.nan
    cpu_s: float = np.nan

    @property
    def kept(self) -> bool:
        """Whether the limits are, and the error is within the tolerance where it was at full tempo."""
        missed = self.full_tempo_mm <= self.tolerance_mm < self.after_mm
        return not (self.excess > EXCEEDED or missed)


def limited_shot(shot: CompiledShot, quantity: str, share: float) -> CompiledShot:
    """The shot with motors that have a share of what the animation needs.

    Args:
        quantity: One of `QUANTITIES`; the effort is that of the rigid robot.
    """
    free, end = without_limits(shot.character), float(shot.animation.frame_times[-1])
    if quantity in ORDERS:
        times, curves = np.linspace(0.0, end, FINE), _as_animated(free, shot)
        needed = np.abs(curves(times, ORDERS[quantity]))
    else:
        limited = replace(free, motors=tuple(replace(motor, max_torque=1e12) for motor in free.motors))
        given = tempo_input(shot.with_character(limited), RunSettings(), shot.animation.tracks)
        if given.efforts is None:
            raise ShotError("its servos keep their torque by themselves", remedy="Add --limits velocity")
        needed = np.abs(given.efforts.at_rest + given.efforts.by_square)
    most = share * needed.max(axis=0)
    most = np.maximum(most, LEAST * most.max())
    speeds, accelerations, efforts = (most if quantity == own else np.full(len(most), np.inf) for own in QUANTITIES)
    motors = tuple(
        replace(motor, max_velocity=float(speed), max_acceleration=float(acceleration), max_torque=float(effort))
        for motor, speed, acceleration, effort in zip(free.motors, speeds, accelerations, efforts, strict=True)
    )
    return shot.with_character(replace(free, motors=motors))


def without_limits(character: Character) -> Character:
    """A character whose motors can do anything, and that does not loop."""
    motors = tuple(
        replace(motor, max_velocity=np.inf, max_acceleration=np.inf, max_jerk=np.inf, max_torque=np.inf)
        for motor in character.motors
    )
    return replace(character, motors=motors, retarget=replace(character.retarget, cyclic=False))


def measure(
    name: str, shot: CompiledShot, quantity: str, share: float, full: tuple[float, float] | None, rigid: bool = False
) -> Row:
    """One row.

    Args:
        rigid: Whether the tempo is that of rigid links, which nothing makes vibrate.
        full: Error [m] and processor time [s] at full tempo without limits; None: nothing is searched.

    Raises:
        ShotError: No tempo helps, or the shot cannot be processed.
    """
    limited, options = limited_shot(shot, quantity, share), RunSettings(retime=TempoSettings(slowest=SLOWEST))
    given = tempo_input(limited, options, shot.animation.tracks)
    given = replace(given, lowest_frequency=np.inf) if rigid else given
    found = find_tempo(given, TempoSettings(slowest=SLOWEST), shot.character.path)
    toppra = toppra_added(limited) if quantity in ORDERS else np.nan
    bounds = found.report.lower_bound, toppra, found.added, found.report.uniform_added
    row = Row(name, quantity, share, *bounds, tolerance_mm=1e3 * tolerance_of(shot.character, None))
    if full is None:
        return row
    begin = time.process_time()
    result = optimize_with_tempo(limited, options, lambda fraction, message: None)
    spent = time.process_time() - begin
    if result.interrupted:
        raise KeyboardInterrupt  # a row of half a search says nothing, and the user asked for an end
    assert result.after is not None and result.retimed is not None
    tempo = result.retimed.animation.tempo
    return replace(
        row,
        added_s=0.0 if tempo is None else tempo.added,
        full_tempo_mm=1e3 * full[0],
        before_mm=1e3 * _largest(result.before.position_errors[result.before.motion.judged]),
        after_mm=1e3 * _largest(result.after.position_errors[result.after.motion.judged]),
        excess=excess_of(limited, result, quantity),
        full_tempo_cpu_s=full[1],
        cpu_s=spent,
    )


def excess_of(limited: CompiledShot, result: Result, quantity: str) -> float:
    """By how much curves exceed limits, as a share of them, by other means than those of the search."""
    performance = limited.at(result.retimed)
    motors, animation = performance.character.motors, performance.animation
    if quantity in ORDERS:
        times, order = np.linspace(0.0, float(animation.frame_times[-1]), FINE), ORDERS[quantity]
        values = commanded_curves(performance.character, animation, result)(times, 0)
        reached = np.abs(np.diff(values, order, axis=0)).max(axis=0) / (times[1] - times[0]) ** order
        most = [motor.max_velocity if order == 1 else motor.max_acceleration for motor in motors]
        return float(np.max(reached / most)) - 1.0
    finer = RunSettings(step=0.25 * result.step_s, pre_roll=result.pre_roll_s, integrator="newmark")
    played = performance.with_tracks(found_tracks(result, animation))
    run = simulate_shot(played, finer, lambda fraction, message: None).before.motion
    efforts = np.abs(run.motor_efforts[run.judged]).max(axis=0)
    return float(np.max(efforts / [motor.max_torque for motor in motors])) - 1.0


def toppra_added(shot: CompiledShot) -> float:
    """What TOPP-RA adds for limits of speed and acceleration, never faster than the animation [s]; NaN without it."""
    try:
        from toppra import SplineInterpolator, setup_logging
        from toppra.algorithm import TOPPRA
        from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
    except ImportError:
        return np.nan
    setup_logging("ERROR")
    end = float(shot.animation.frame_times[-1])
    times = np.linspace(0.0, end, INSTANTS * int(np.ceil(end)) + 1)
    curves, motors = _as_animated(shot.character, shot), shot.character.motors
    # a joint that moves as the animation's time does keeps the tempo from exceeding it
    speeds = np.array([*(motor.max_velocity for motor in motors), 1.0])
    limits = [JointVelocityConstraint(np.stack([-speeds, speeds], axis=1))]
    if np.isfinite(most := np.array([motor.max_acceleration for motor in motors])).all():
        most = np.append(most, NO_LIMIT)
        limits.append(JointAccelerationConstraint(np.stack([-most, most], axis=1)))
    path = SplineInterpolator(times, np.concatenate([curves(times, 0), times[:, None]], axis=1))
    program = TOPPRA(limits, path, gridpoints=times)
    for ends in (1.0, 0.0):  # at rest where it would be too fast there
        _, speeds, _ = program.compute_parameterization(ends, ends)
        if speeds is not None:
            break
    return float(np.sum(2.0 * np.diff(times) / (speeds[1:] + speeds[:-1]))) - end


def _as_animated(character: Character, shot: CompiledShot) -> Any:
    """The curves of the animation itself."""
    return commanded_curves(character, replace(shot.animation, current=shot.animation.tracks), None)


def _largest(errors: Array) -> float:
    return float(errors.max(initial=0.0))


def _at_full_tempo(shot: CompiledShot) -> tuple[float, float]:
    begin = time.process_time()
    free = shot.with_character(without_limits(shot.character))
    result = optimize_with_tempo(free, RunSettings(), lambda fraction, message: None)
    assert result.after is not None
    return _largest(result.after.position_errors[result.after.motion.judged]), time.process_time() - begin


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("tempo", __doc__, SAMPLES)
    parser.add_argument("--shares", metavar="SHARE", type=float, nargs="+", default=SHARES)
    parser.add_argument("--limits", metavar="QUANTITY", nargs="+", choices=QUANTITIES, default=QUANTITIES)
    parser.add_argument("--tempo-only", action="store_true", help="find the tempo of the rigid robot, and no curves")
    parser.add_argument("--rigid", action="store_true", help="the same as if all links were rigid")
    options = parser.parse_args(arguments)
    rows, failed = [], False
    for path in options.shots:
        name, shot = Path(path).stem, load(path)
        full = None if options.tempo_only or options.rigid else _at_full_tempo(shot)
        for quantity, share in product(options.limits, options.shares):
            try:
                rows.append(measure(name, shot, quantity, share, full, options.rigid))
            except ShotError as error:
                failed = True
                say(f"{name}, {quantity} {share:g}: {error}")
            keep(options, Row, rows)
    finish(options, "Added time, and largest errors", rows)
    return int(failed or not all(row.kept for row in rows))
