"""Commands that were optimised for a calibrated machine, replayed in an independent model that fits its recordings."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.model import RunSettings
from calmotion.retargeting import optimize_shot
from calmotion.simulation import CompiledShot, compile_shot
from calmotion_plugins.calibration import Calibration, prediction_errors, unexplained_share


@dataclass(frozen=True)
class Replayed:
    """Errors at the target.

    Attributes:
        fitted: The recordings of the fit.
        shot: Whose commands were optimised.
        before_mm, after_mm: Largest in the independent model, with the commands as animated and as optimised.
        told_mm: What the report of the optimised commands tells: largest error of the simulation, and what the fit was
            off its recordings at the target, as errors that have nothing to do with each other (root of the sum of
            squares). Of a gauge, which does not tell of the target, it is the share of the error as animated that the
            fit left of its recordings' shake.
    """

    fitted: str
    shot: str
    before_mm: float
    after_mm: float
    told_mm: float


def replayed(
    fitted: str, name: str, robot: CompiledShot, fit: Calibration, largest: Callable[[Array, Array, Array], float],
    step: float, sensors: Collection[str],
) -> Replayed:  # fmt: skip
    """Optimise a shot for a calibrated robot of one motor, and replay both commands in the independent model.

    Args:
        fitted, name: As of `Replayed`.
        robot: The shot with the calibrated robot.
        fit: The calibration.
        largest: Largest error [mm] of the independent model by uniform times [s], commands and intended angles [rad],
            shape [n] each.
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
    own = [k for k, target in enumerate(targets) if target.position_weight > 0.0]
    before, after = (1e3 * float(run.position_errors[rows][:, own].max()) for run in (result.before, result.after))
    off = 1e3 * prediction_errors(robot.character, fit)[1] or unexplained_share(fit) * before
    return Replayed(
        fitted, name, largest(times, intended, intended), largest(times, calm, intended),
        float(np.hypot(after, off)),
    )  # fmt: skip
