"""Commands that were optimised for a calibrated strip, replayed in the independent beam that fits its recordings."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.model import RunSettings
from calmotion.retargeting import optimize_shot
from calmotion.simulation import CompiledShot, compile_shot

from .two_mode_beam import Fitted


@dataclass(frozen=True)
class Replayed:
    """Errors at the end of the strip.

    Attributes:
        fitted: The recordings of the fit.
        shot: Whose commands were optimised.
        before_mm, after_mm: Largest in the beam, with the commands as animated and as optimised.
        told_mm: What the report of the optimised commands tells: largest error of the simulation, and the share of the
            error as animated that the fit left of its recordings' shake, as errors that have nothing to do with each
            other (root of the sum of squares).
    """

    fitted: str
    shot: str
    before_mm: float
    after_mm: float
    told_mm: float


def replayed(
    fitted: str, name: str, robot: CompiledShot, share: float, beam: Fitted, step: float, sensors: Collection[str]
) -> Replayed:  # fmt: skip
    """Optimise a shot for a calibrated robot, and replay both commands in the beam.

    Args:
        fitted, name: As of `Replayed`.
        robot: The shot with the calibrated robot.
        share: That the calibration left of the shake in its recordings.
        beam: Fitted on the same recordings.
        step: Of the simulations [s].
        sensors: Paths of targets where sensors are, which do not count.

    Raises:
        ShotError: The shot cannot be optimised.
    """
    targets = [replace(own, position_weight=float(own.path not in sensors)) for own in robot.character.targets]
    robot = compile_shot(replace(robot.character, targets=tuple(targets)), robot.animation, robot.bodies)
    result = optimize_shot(robot, RunSettings(step=step), lambda fraction, message: None)
    assert result.after is not None
    motion = result.after.motion
    times, rows = motion.times[motion.judged], motion.judged
    intended, calm = result.reference.motor_values[rows, 0], motion.motor_values[rows, 0]
    aim = (beam.strip.root + beam.strip.length) * intended

    def largest(hub: Array) -> float:
        return 1e3 * float(np.abs(beam.strip.end(times, hub, beam.damping) - aim).max())

    own = [k for k, target in enumerate(targets) if target.position_weight > 0.0]
    before, after = (1e3 * float(run.position_errors[rows][:, own].max()) for run in (result.before, result.after))
    return Replayed(fitted, name, largest(intended), largest(calm), float(np.hypot(after, share * before)))
