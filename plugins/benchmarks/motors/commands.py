"""What commands that are optimised with the model of the motors bring, confirmed by MuJoCo.

`calmotion bench motor-commands SHOT ...` takes robots of rigid bodies whose motors have gains or are named. It
simulates the animation as the command (that is what an optimisation for ideal motors finds on rigid links), finds
commands with the model of the motors, and plays both on the motors in Calmotion and in MuJoCo, exactly as they are
written. MuJoCo has the robot's own file where `--mjcf` names it, else a lumped model of the robot of the shot.
Errors are the largest distances of the targets from the intended motion. The command fails where optimised commands
leave more than a tenth of the animation's error, or where Calmotion tells either error more than a tenth off, beside
what friction may hold.

`samples/real/compose.py` makes such shots of a KUKA iiwa and of the upper body of a Unitree G1:

python samples/real/compose.py samples/real/iiwa_reach.usda KUKA.usda build/iiwa.usda
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Animation, Character, Result, RunSettings, Simulation, Track
from calmotion.retargeting import optimize_shot
from calmotion.simulation import CompiledShot, compile_shot, simulate_shot
from calmotion.tolerance import with_friction_band, with_gains_used

from ..common.reporting import bench_parser, finish, keep
from .lumped_robot import MUJOCO_STEP, simulate_lumped
from .original import simulate_original

ALLOWED = 0.1  # of the error of commands for ideal motors
TOLD = 0.1  # of that error in MuJoCo, by which Calmotion may be off
_STEP = 1.0 / 480.0  # of the search [s]
_FINER = 4  # how many times shorter the step is by which Calmotion tells the errors


@dataclass(frozen=True)
class Row:
    """One robot.

    Attributes:
        shot: Name.
        motors: Number of compliant motors.
        ideal_mm, optimised_mm: Largest error of the animation as the command, and of the optimised commands [mm].
        share: The second over the first.
        mujoco_ideal_mm, mujoco_optimised_mm, mujoco_share: The same in MuJoCo.
        told: The first error over the one in MuJoCo.
        apart: Largest difference of the two programs at the joints, for the optimised commands, over their motion.
        friction_mm: How far friction may hold a target off, which no program can know [mm].
    """

    shot: str
    motors: int
    ideal_mm: float
    optimised_mm: float
    share: float
    mujoco_ideal_mm: float
    mujoco_optimised_mm: float
    mujoco_share: float
    told: float
    apart: float
    friction_mm: float = 0.0

    @property
    def kept(self) -> bool:
        """Whether commands and what is told of them are of use."""
        left = self.mujoco_optimised_mm - self.optimised_mm
        is_told = abs(self.told - 1.0) <= TOLD and abs(left) <= TOLD * self.mujoco_optimised_mm + self.friction_mm
        return max(self.share, self.mujoco_share) <= ALLOWED and is_told


def giving_shot(path: str, seconds: float | None) -> CompiledShot:
    """The shot with rigid bodies and with the gains of its motors in use.

    Args:
        seconds: How much of its beginning is taken; None: all.

    Raises:
        ShotError: It cannot be read, a body has no mass of its own, or no motor has gains.
    """
    from calmotion.usd import read_shot

    character, animation, _ = read_shot(path)
    character = with_gains_used(with_rigid_bodies(character))
    if seconds is not None:
        animation = beginning(animation, seconds)
    return compile_shot(character, animation)


def with_rigid_bodies(character: Character) -> Character:
    """The character with the masses that its bodies have as rigid ones."""
    for body in character.bodies:
        if body.mass is None:
            raise ShotError(
                "a flexible link without a mass of its own",
                path=body.path,
                attribute="physics:mass",
                remedy="Author the mass that it has as a rigid body",
            )
    return replace(character, bodies=tuple(replace(body, flexible=None) for body in character.bodies))


def beginning(animation: Animation, seconds: float) -> Animation:
    """The frames up to a time [s]."""

    def cut(track: Track) -> Track:
        kept = track.times <= seconds + 1e-9
        return replace(track, times=track.times[kept], values=track.values[kept])

    frames = animation.frame_times[animation.frame_times <= seconds + 1e-9]
    tracks = tuple(map(cut, animation.tracks))
    return replace(animation, frame_times=frames, tracks=tracks, current=tracks)


def compare(
    name: str, shot: CompiledShot, mjcf: str | None = None, step: float = _STEP, mujoco_step: float = MUJOCO_STEP
) -> Row:
    """Both commands on the motors of a shot, in both programs.

    Args:
        mjcf: The robot's own file, for MuJoCo; None: a lumped model.
        step, mujoco_step: Of Calmotion and of MuJoCo [s].

    Raises:
        ShotError: The robot cannot be simulated, or has no place in the lumped model.
    """
    options = RunSettings(step=step, tolerance=1e-5)
    result = optimize_shot(shot, options, lambda fraction, message: None)
    assert result.after is not None
    told = [_told(shot, run, options) for run in (result.before, result.after)]
    ours = [_largest(result, positions) for positions in told]
    band = with_friction_band(shot, result, options).friction_band_m
    play = simulate_lumped if mjcf is None else partial(simulate_original, mjcf)
    played = [
        play(shot.character, run.motion.times, run.motion.motor_values, mujoco_step)
        for run in (result.before, result.after)
    ]
    theirs = [_largest(result, motion.target_positions) for motion in played]
    apart = _apart(told[1], played[1].target_positions)
    return Row(
        shot=name,
        motors=len(shot.character.motors),
        ideal_mm=1e3 * ours[0],
        optimised_mm=1e3 * ours[1],
        share=ours[1] / ours[0],
        mujoco_ideal_mm=1e3 * theirs[0],
        mujoco_optimised_mm=1e3 * theirs[1],
        mujoco_share=theirs[1] / theirs[0],
        told=ours[0] / theirs[0],
        apart=apart,
        friction_mm=0.0 if band is None else 1e3 * float(band.max(initial=0.0)),
    )


def _told(shot: CompiledShot, run: Simulation, options: RunSettings) -> Array:
    """Where Calmotion has the targets by a finer step than that of the search, at the times of a run, [T, K, 3] [m].

    Commands that a search finds fit the errors of its own step."""
    tracks = [Track(run.motion.times, column) for column in run.motion.motor_values.T]
    spacing = float(run.motion.times[1] - run.motion.times[0])
    finer = replace(options, step=spacing / _FINER, integrator="generalized-alpha", pre_roll=0.0)
    begin, end = run.motion.times[[0, -1]]
    frames = np.arange(round((end - begin) / spacing) + 1) * spacing
    at_zero = tuple(replace(track, times=track.times - begin) for track in tracks)
    moving = tuple(replace(frame, times=frame.times - begin) for frame in shot.animation.moving)
    animation = replace(shot.animation, frame_times=frames, tracks=at_zero, current=at_zero, moving=moving)
    found = simulate_shot(compile_shot(shot.character, animation), finer, lambda fraction, message: None)
    return found.before.motion.target_positions[::_FINER]


def _largest(result: Result, positions: Array) -> float:
    judged = result.reference.judged
    off = np.linalg.norm(positions - result.reference.target_positions, axis=2)[judged]
    return float(off.max())


def _apart(ours: Array, theirs: Array) -> float:
    size = float(np.ptp(theirs, axis=0).max())
    return float(np.linalg.norm(ours - theirs, axis=2).max()) / size


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("motor-commands", __doc__)
    parser.add_argument("shots", metavar="SHOT", nargs="+", help="USD file of a robot whose motors have gains")
    parser.add_argument("--mjcf", metavar="FILE", nargs="+", help="own file of each SHOT's robot, for MuJoCo")
    parser.add_argument("--seconds", metavar="S", type=float, help="take only the beginning of each shot")
    options = parser.parse_args(arguments)
    files = options.mjcf or [None] * len(options.shots)
    if len(files) != len(options.shots):
        parser.error(f"--mjcf names {len(files)} files for {len(options.shots)} shots")
    rows = []
    for path, file in zip(options.shots, files, strict=True):
        rows.append(compare(Path(path).stem, giving_shot(path, options.seconds), file))
        keep(options, Row, rows)
    finish(options, "Largest error of commands", rows)
    return int(not all(row.kept for row in rows))
