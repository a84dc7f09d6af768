"""What the play of gears would cost: reversals of the torque that each transmits, and the way of the targets across it.

Within its play b a gear lies on one side or on the other, as the torque that it transmits pushes it. A robot is
calibrated in its first pose, so that only changes of side count: the joint of motor m is then off by

    b_m (s_m(t) - s_m(0)) / 2,    s_m = +1 or -1

and a target by the sum over the motors of what this angle moves it, on rigid links. What is within a fiftieth of a
gear's largest torque does not change its side.
"""

from dataclasses import replace

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.model import Motion, Result
from calmotion.model.character import Character
from calmotion.model.result import LostMotion
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.intended_motion import rigid_motion
from calmotion.simulation.preparation import Prepared, prepare

_QUIET = 0.02  # of a gear's largest torque: less does not move it to its other side


def with_lost_motion(shot: CompiledShot, result: Result, options: RunSettings) -> Result:
    """The result with what the play of the motors would do to its input and to its curves; the result itself where no
    motor has any.

    Args:
        options: Of the run.
    """
    playing = [k for k, motor in enumerate(shot.character.motors) if motor.backlash > 0.0]
    if not playing:
        return result
    prepared = prepare(shot, replace(options, step=result.step_s))
    simulations = [result.before] if result.after is None else [result.before, result.after]
    found = tuple(_lost_motion(prepared, simulation.motion, playing) for simulation in simulations)
    return replace(result, lost_motion=found)


def transmitted_efforts(character: Character, motion: Motion) -> Array:
    """The torque [N m] or force [N] that each motor's gear transmits to its joint, shape [T, M]: that of a servo's
    motor is another, since it also turns its rotor.

    Args:
        motion: One that was simulated.
    """
    assert motion.joint_forces is not None and motion.joint_moments is not None
    found = np.zeros(motion.motor_values.shape)
    for k, motor in enumerate(character.motors):
        joint = character.joints[motor.joint]
        loads = motion.joint_forces if motor.linear else motion.joint_moments
        axis = _matrix(joint.frame1.rotation)[:, 2]
        axes = _rotated(motion.rotations[:, joint.body1], axis)
        found[:, k] = np.einsum("ti,ti->t", axes, loads[:, motor.joint])
    return found


def sides(efforts: Array) -> IntArray:
    """On which side gears lie, 1 or -1, for the efforts that they transmit, shape [T]; 0 where there is no effort."""
    least = _QUIET * float(np.abs(efforts).max(initial=0.0))
    pushed = np.where(np.abs(efforts) > least, np.sign(efforts), 0.0).astype(int)
    marked = np.flatnonzero(pushed)
    if not len(marked):
        return pushed
    # between two pushes a gear stays where it is; before the first one it lies where that puts it
    last = np.maximum.accumulate(np.where(pushed != 0, np.arange(len(pushed)), marked[0]))
    return np.asarray(pushed[last])


def _lost_motion(prepared: Prepared, motion: Motion, playing: list[int]) -> LostMotion:
    character, judged = prepared.character, motion.judged
    efforts = transmitted_efforts(character, motion)[judged]
    rest = rigid_positions(prepared, motion.motor_values)
    off = np.zeros_like(motion.target_positions[judged])
    reversals, unknown = [], []
    times = motion.times[judged]
    for k in playing:
        side = sides(efforts[:, k])
        changed = np.flatnonzero(np.diff(side)) + 1
        reversals.append(times[changed])
        moved = motion.motor_values.copy()
        moved[:, k] += character.motors[k].backlash
        there = None if rest is None else rigid_positions(prepared, moved)
        if rest is None or there is None:
            unknown.append(k)
            continue
        off += 0.5 * (side - side[0])[:, None, None] * (there - rest)[judged]
    distance = np.linalg.norm(off, axis=2)
    worst = np.argmax(distance, axis=0)
    largest = distance[worst, np.arange(distance.shape[1])]
    return LostMotion(tuple(playing), tuple(reversals), largest, times[worst], tuple(unknown))


def rigid_positions(prepared: Prepared, values: Array) -> Array | None:
    """Where a rigid robot has its targets for values of its motors, shape [T, K, 3]; None where it cannot follow."""
    grid = prepared.grid
    if grid.cyclic:  # the instant before the first one is left out of motions
        values = np.concatenate([values[-2:-1], values])
    rates = np.gradient(values, grid.h, axis=0)
    try:
        found = rigid_motion(prepared.model, values, rates, grid.h, prepared.world, grid.cyclic)
    except SimulationFailure:
        return None
    return found.target_positions[1:] if grid.cyclic else found.target_positions


def _matrix(rotation: Array) -> Array:
    out = np.zeros((3, 3))
    matrix_of(rotation, out)
    return out


def _rotated(rotations: Array, vector: Array) -> Array:
    """A vector of a body's axes in the world's, for quaternions of shape [T, 4]."""
    w, v = rotations[:, :1], rotations[:, 1:]
    twice = 2.0 * np.cross(v, vector)
    return np.asarray(vector + w * twice + np.cross(v, twice))
