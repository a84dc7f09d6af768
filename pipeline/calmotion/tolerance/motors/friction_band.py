"""How far Coulomb friction may hold a robot from where its motors' gains would have it, which no command changes.

A joint at rest stands anywhere within the friction over the gain, f / k_p, of the angle at which its motor pulls
nothing; the simulation has it in the middle, since friction is smooth there. A target is off by at most the sum over
the motors of what these angles move it, on rigid links.
"""

from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Character, Result
from calmotion.model.motor import SERVO
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.preparation import prepare
from calmotion.tolerance.motors.backlash import rigid_positions


def bands(character: Character) -> Array:
    """The angle [rad] or length [m] within which each motor's friction may hold its joint, shape [M]."""
    return np.array([m.rotor.friction / m.position_gain if m.model == SERVO else 0.0 for m in character.motors])


def with_friction_band(shot: CompiledShot, result: Result, options: RunSettings) -> Result:
    """The result with the largest distance by which friction may hold each target off; the result itself where no motor
    has any, or a rigid robot cannot follow.

    Args:
        options: Of the run.
    """
    angles = bands(shot.character)
    if not angles.any():
        return result
    prepared = prepare(shot, replace(options, step=result.step_s))
    motion = (result.after or result.before).motion
    rest, total = rigid_positions(prepared, motion.motor_values), np.zeros(motion.target_positions.shape[:2])
    for k in np.flatnonzero(angles):
        moved = motion.motor_values.copy()
        moved[:, k] += angles[k]
        there = None if rest is None else rigid_positions(prepared, moved)
        if rest is None or there is None:
            return result
        total += np.linalg.norm(there - rest, axis=2)
    return replace(result, friction_band_m=total[motion.judged].max(axis=0, initial=0.0))
