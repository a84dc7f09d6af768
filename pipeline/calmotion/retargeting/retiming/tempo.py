"""The tempo of a shot: from the motion of its rigid robot, the limits of its motors, and its pinned times."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model.curves import Sample
from calmotion.model.outputs import Tempo
from calmotion.model.tempo import Stretch, TempoReport, TempoSettings, TimeMap
from calmotion.retargeting.retiming.program import NOTICED, WITHIN, Duration, Path, TempoProgram
from calmotion.retargeting.retiming.splines import StretchBasis
from calmotion.simulation.inputs.tempo import MotorEfforts, TempoLimits, needed_tempo
from calmotion.simulation.inputs.time_grid import after_knots

SHORTEST, LONGEST = 1.0 / 8.0, 1.0 / 24.0  # time within which the tempo changes, in frames and in seconds
STRETCHED = 1e-3  # deviation from 1 that counts as another tempo
NEARLY = 0.01  # share of a limit within which it is reached
SPREAD = 1e-5  # stretch that weighs as much as none when the time to a whole frame is spread: most goes where more is


@dataclass(frozen=True, eq=False)
class TempoInput:
    """What a tempo follows from.

    Attributes:
        times: At equal distances, from the first frame to the last [s], shape [T].
        curves: Of the M motors, over the animation.
        limits: Of the motors.
        efforts: Of the rigid robot at these times; None where none is limited.
        frame: Length of a frame [s].
        lowest_frequency: What the tempo may excite [Hz]; infinite of a rigid robot.
        names, units: Paths of the motors and units of their efforts, for errors.
    """

    times: Array
    curves: Sample
    limits: TempoLimits
    efforts: MotorEfforts | None
    frame: float
    lowest_frequency: float = np.inf
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class FoundTempo:
    """A tempo.

    Attributes:
        map: The times of the performance; None where the animation's tempo does.
        frames: Of the performance, which ends on one: their number.
        report: What it costs.
        excess: By how much limits are still exceeded, as a share of them, since nothing may be slower.
        added: Time [s], before the last frame was completed.
    """

    map: TimeMap | None
    frames: int
    report: TempoReport
    excess: float
    added: float


def find_tempo(given: TempoInput, settings: TempoSettings, path: str) -> FoundTempo:
    """The tempo that adds the least time.

    Args:
        given: What it follows from.
        settings: What may change.
        path: Of the character, for errors.

    Raises:
        ShotError: Pinned times and limits contradict each other, or no tempo helps.
    """
    needed = needed_tempo(given.times, given.curves(given.times, 0), given.limits, given.efforts)
    if (weak := needed.too_weak) is not None:
        unit = given.units[weak.motor] if given.units else "N m"
        raise ShotError(
            "no tempo helps: the motor is too weak to hold the robot in a pose against its weight",
            path=given.names[weak.motor] if given.names else path,
            attribute="calm:motor:maxTorque",
            found=f"{given.limits.effort[weak.motor]:.4g} {unit}, where it takes {weak.needed:.4g} {unit} at "
            f"{weak.time_s:.2f} s however slow the motion is",
            remedy="Raise it if the motor can do more, make the robot lighter, change the pose, or leave --retime out.",
        )
    end = float(given.times[-1])
    if needed.uniform == 1.0:
        unmoved = tuple((time, 0.0) for time in settings.pinned)
        return FoundTempo(None, round(end / given.frame) + 1, TempoReport(0.0, 0.0, (), unmoved), 0.0, 0.0)
    # what changes within a radian of its slowest vibration hardly makes a robot vibrate
    scale = float(np.clip(1.0 / (2.0 * np.pi * given.lowest_frequency), SHORTEST * given.frame, LONGEST))
    basis = StretchBasis.over(end, given.frame / np.ceil(given.frame / scale - 1e-9))  # curves have knots at frames
    pins = tuple(Duration(a, b, b - a) for a, b in zip(settings.pinned[:-1], settings.pinned[1:], strict=True))
    program = TempoProgram(basis, _path(given, basis), settings.slowest, settings.fastest, scale, pins)
    c = program.solve(np.interp(basis.centres, needed.times, needed.stretch))
    if pins:
        _refuse_contradiction(given, settings, path, program, c)
    takes = float(basis.integral(0.0, end) @ c)
    frames = int(np.ceil(takes / given.frame - 1e-6))
    whole = replace(
        program,
        durations=(*pins, Duration(0.0, end, frames * given.frame)),
        weights=1.0 / (SPREAD + np.abs(c - 1.0)),
    )
    found = whole.solve(c)
    if pins and whole.missed(found) > NOTICED:
        _refuse_missed(path, whole.missed(found))
    report = _report(settings, needed, program, c, basis.time_map(found))
    excess = whole.excess(found)
    if excess > NOTICED:
        report = replace(report, lacking=float(np.max(needed.stretch)))
    return FoundTempo(basis.time_map(found), frames + 1, report, excess, takes - end)


def _path(given: TempoInput, basis: StretchBasis) -> Path:
    """What limits the tempo, at the instants of a basis."""
    # the third derivative of a cubic is that of the interval between its knots
    at = tuple(given.curves(after_knots(basis.times, order, given.frame), order) for order in (1, 2, 3))
    efforts = given.efforts
    if efforts is not None:
        parts = (efforts.at_rest, efforts.by_square, efforts.by_change)
        efforts = MotorEfforts(*(CubicSpline(given.times, part)(basis.times) for part in parts))
    return Path((at[0], at[1], at[2]), given.limits, efforts)


def _refuse_contradiction(
    given: TempoInput, settings: TempoSettings, path: str, program: TempoProgram, c: Array
) -> None:
    """Refuse pins between which the limits leave too little time.

    Raises:
        ShotError: With both pins, and the least change that would do.
    """
    if program.excess(c) <= NOTICED:
        return
    for part in program.durations:
        needs = _least_duration(given, part, settings.fastest)
        if needs <= part.length + NOTICED:
            continue
        later = f"let the second be {needs - part.length:.3f} s later"
        fastest, slower = settings.fastest, 0.05
        if _least_duration(given, part, slower) <= part.length:
            while fastest - slower > 5e-3:
                middle = 0.5 * (fastest + slower)
                fits = _least_duration(given, part, middle) <= part.length
                fastest, slower = (fastest, middle) if fits else (middle, slower)
            later += f", or allow parts to be faster with fastest={np.floor(100.0 * slower) / 100.0:g}"
        raise ShotError(
            "the limits of the motors leave too little time between two pinned times",
            path=path,
            attribute="calm:retime:pinned",
            found=f"{part.start:.3f} s and {part.end:.3f} s after the first frame, between which the motors need "
            f"{needs:.3f} s at least, {needs - part.length:.3f} s more",
            remedy=f"Leave out one of them, {later}.",
        )


def _refuse_missed(path: str, missed: float) -> None:
    """Refuse pins that no stretch keeps, though the rigid robot could hurry between each two of them.

    Raises:
        ShotError: With what is missed.
    """
    raise ShotError(
        "the limits of the motors, of the stretch and the pinned times cannot be kept together",
        path=path,
        attribute="calm:retime:pinned",
        found=f"a distance of two of them is off by {missed:.3f} s at least",
        remedy="Allow parts to be faster with a smaller fastest, or leave out a pinned time.",
    )


def _least_duration(given: TempoInput, part: Duration, fastest: float) -> float:
    """What the rigid robot needs for a part of the animation at least [s]."""
    tempo = needed_tempo(given.times, given.curves(given.times, 0), given.limits, given.efforts, fastest)
    total = CubicSpline(tempo.times, tempo.stretch).antiderivative()
    return float(total(part.end) - total(part.start))


def _report(settings: TempoSettings, needed: Tempo, program: TempoProgram, c: Array, tempo: TimeMap) -> TempoReport:
    """The report on a tempo.

    Args:
        program, c: The program and where it ended, before the time to a whole frame was added.
    """
    basis, times = program.basis, program.basis.times
    stretch = tempo.stretch(times)
    other = np.abs(stretch - 1.0) > STRETCHED
    starts = np.flatnonzero(np.diff(np.concatenate([[False], other])) & other)
    stops = np.flatnonzero(np.diff(np.concatenate([other, [False]])) & other)
    stretches = []
    for first, last in zip(starts, stops, strict=True):
        start = float(basis.breaks[np.searchsorted(basis.breaks, times[first], "right") - 1])
        end = float(basis.breaks[np.searchsorted(basis.breaks, times[last])])
        takes = float(np.diff(tempo.performed(np.array([start, end])))[0])
        stretches.append(Stretch(start, end, takes / (end - start), _reached(program, c, slice(first, last + 1))))
    pinned = np.array(settings.pinned)
    shifts = tempo.performed(pinned) - pinned if len(pinned) else pinned
    return TempoReport(
        needed.uniform_added_s,
        needed.least_added_s,
        tuple(stretches),
        tuple(zip(settings.pinned, shifts.tolist(), strict=True)),
    )


def _reached(program: TempoProgram, c: Array, instants: slice) -> tuple[tuple[int, str], ...]:
    """The limits that are reached at some instants, those at most of them first."""
    counts: dict[tuple[int, str], int] = {}
    for term in program.terms(c):
        reached = np.sum(np.abs(term.value[instants]) > 1.0 - WITHIN - NEARLY, axis=0)
        counts |= {(int(motor), term.quantity): int(reached[motor]) for motor in np.flatnonzero(reached)}
    return tuple(sorted(counts, key=lambda key: -counts[key]))
