"""Shots that were performed and recorded, with the parameters of the robot in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.errors import ShotError
from calmotion.model import PRESCRIBED, RunSettings
from calmotion.multibody import IMPLICIT, SimulationFailure
from calmotion.recordings import ANGLE, EFFORT, SensorRecording
from calmotion.simulation import MAX_STEP, CompiledShot, failure_error, prepare

from ..model import kinds
from .motor_groups import grouped
from .parameters import Parameter, robot_parameters
from .recordings.sensors import Sensor
from .robots import robot_at, robot_with
from .signals import Signals, ends_at_rest, signals_of

if TYPE_CHECKING:
    from .calibrate import CalibrationSettings

FIRST = 5  # samples that tell where an encoder begins
OFF, SURE = 0.03, 5.0  # from where the shot begins: share of the motion, and standard deviations of the noise
STIFF = (kinds.MODULUS, kinds.POSITION_GAIN, kinds.GEAR_STIFFNESS)  # what decides about frequencies
SCHEME = "generalized-alpha"  # a quarter of BDF2's error, and no damping to speak of
STIFFER = 30.0  # times as stiff as the shot's: a robot that hardly shakes, by which clocks are found


@dataclass(frozen=True, eq=False)
class Take:
    """A shot that was performed and recorded.

    Attributes:
        shot: The compiled shot.
        parameters: Of the robot: the same for all shots, but for nominal values, such as gains of the firmware.
        after: How long the robot is simulated after the end of the shot [s].
        start: Where the motors stand until the recording begins [rad or m], shape [M], NaN where the shot says it;
            None: the robot begins as the shot does.
        begin: When that is, on the robot's clock [s].
        moves: Whether the robot swings already when the shot begins.
    """

    shot: CompiledShot
    parameters: tuple[Parameter, ...]
    after: float
    start: Array | None = None
    begin: float = 0.0
    moves: bool = False

    @property
    def moving(self) -> BoolArray:
        """Which parameters the motion depends on, shape [n]: all but those of rotors of ideal motors."""
        ideal = {motor.path for motor in self.shot.character.motors if motor.model == PRESCRIBED}
        return np.array([not (p.kind in kinds.OF_ROTOR and p.path in ideal) for p in self.parameters], bool)

    @property
    def end(self) -> float:
        """Of the shot [s]."""
        return float(self.shot.animation.frame_times[-1])


def takes_of(
    performed: Sequence[tuple[CompiledShot, Sequence[SensorRecording]]], settings: CalibrationSettings
) -> tuple[list[Take], tuple[str, ...]]:
    """The shots with the parameters of the robot, and the motors whose position gains differ from shot to shot.

    Raises:
        ShotError: The shots have other parameters than the first one: they are not of one robot.
    """
    takes: list[Take] = []
    channels = [channel for _, recordings in performed for recording in recordings for channel in recording.channels]
    efforts = {channel.path for channel in channels if channel.kind == EFFORT}
    for shot, _ in performed:
        parameters = robot_parameters(shot, settings.parameters, settings.priors, efforts)
        if settings.by_motor_type:
            parameters = grouped(parameters, shot.character)
        # what a robot does that is stopped amid a motion is not known
        after = settings.after if ends_at_rest(shot.animation) else 0.0
        takes.append(Take(shot, parameters, after))
        missing = {p.name for p in takes[0].parameters} ^ {p.name for p in parameters}
        if missing:
            raise ShotError(
                "the shots are not of one robot: a parameter is not in both",
                path=shot.character.path,
                attribute="--shot",
                found=min(missing),
                remedy="Give them the same bodies, materials and motors, or name the shared ones with --parameters",
            )
    names = [p.name for p in takes[0].parameters]
    takes = [
        replace(take, parameters=tuple(sorted(take.parameters, key=lambda p: names.index(p.name)))) for take in takes
    ]
    other = [
        row[0].path
        for row in zip(*(take.parameters for take in takes), strict=True)
        if row[0].kind == kinds.POSITION_GAIN and not np.allclose([p.nominal for p in row], row[0].nominal, rtol=1e-6)
    ]
    return takes, tuple(other)


def simulable(shot: CompiledShot, options: RunSettings, after: float) -> tuple[RunSettings, Signals]:
    """Options with a step and an integrator that simulate the shot, and its signals."""
    step = options.step or shot.character.retarget.time_step or MAX_STEP
    given = options.integrator
    schemes = (given,) if given is not None else (SCHEME, "bdf2")
    for scheme in schemes:
        chosen = replace(options, step=step, integrator=scheme)
        try:
            return chosen, signals_of(robot_with(shot, {}), chosen, after)
        except (SimulationFailure, ShotError) as failure:
            if scheme == schemes[-1] or scheme not in IMPLICIT:
                if isinstance(failure, SimulationFailure):
                    raise failure_error(prepare(shot, chosen), failure) from failure
                raise
    raise AssertionError("a scheme either simulates or raises")


def all_simulable(takes: Sequence[Take], options: RunSettings) -> tuple[RunSettings, list[Signals]]:
    """Options with a step and an integrator that simulate all shots, and the signals of each."""
    for take in takes:
        options = simulable(take.shot, options, take.after)[0]
    return options, [simulable(take.shot, options, take.after)[1] for take in takes]


def hardly_shaking(take: Take, options: RunSettings) -> list[Signals]:
    """Signals of a robot of which all that is estimated and gives is far stiffer; none where it cannot be simulated."""
    x = np.array([np.log(STIFFER) / p.spread if p.kind in STIFF else 0.0 for p in take.parameters])
    if not x.any():
        return []
    try:
        return [signals_of(robot_at(take.shot, take.parameters, x), options, take.after)]
    except (SimulationFailure, ShotError):
        return []


def begun(take: Take, sensors: Sequence[Sensor], clocks: Sequence[float], nominal: Signals) -> Take:
    """The shot, begun where the encoders begin, if that is not where the robot of the shot stands.

    Args:
        take: The shot.
        sensors: Of its recordings.
        clocks: What the clock of each of them reads at its first frame [s].
        nominal: Signals of the robot of the shot.
    """
    start, begin = np.full(len(take.shot.character.motors), np.nan), 0.0
    for sensor in sensors:
        channel = sensor.channel
        if channel.kind != ANGLE:
            continue
        known = sensor.used & np.isfinite(channel.values[:, 0])
        times, values = channel.times[known], channel.values[known]
        first = float(times[0]) - clocks[sensor.recording]
        off = float(np.median(values[:FIRST, 0]) - nominal.at(ANGLE, sensor.index, np.array([first]))[0, 0])
        if first > nominal.times[0] and abs(off) > max(OFF * float(np.ptp(values)), SURE * sensor.sigma):
            start[sensor.index], begin = float(np.median(values[:FIRST, 0])), max(begin, first)
    return take if np.all(np.isnan(start)) else replace(take, start=start, begin=begin)
