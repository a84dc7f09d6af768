"""A robot in its own MJCF file, on commands exactly as they are written: another program, and a model that is not ours.

Masses, armature, friction, limits of force, contacts and the integrator are those of the file. Its actuators are set to
the commands, whatever they then do with them; joints and bodies are found by their names.
"""

from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Character, Target
from scipy.interpolate import CubicSpline

from .lumped_robot import MUJOCO_STEP, PlayedMotion, mujoco_module

_SETTLES = 20.0  # longest time in which the robot comes to rest at its first commands [s]
_REST = 1e-6  # [rad/s or m/s]


def simulate_original(
    path: str, character: Character, times: Array, commands: Array, step: float = MUJOCO_STEP
) -> PlayedMotion:
    """The robot of an MJCF file on commands, from the rest in which its actuators hold it at their first ones.

    MuJoCo's integrators have errors of first order in their step (a KUKA by steps of 2 ms is 1.3 mm off): motions by
    one step and by half of it are extrapolated to none.

    Args:
        path: The file.
        character: The shot's robot, for the names of the joints that are driven and for its targets.
        times: Equidistant [s], shape [T].
        commands: Of its motors, shape [T, M]; splines between the times.
        step: Of MuJoCo, the longer one [s]; it is shortened to divide those of the times, and to what the file has.

    Raises:
        ShotError: The file cannot be read, or a joint, body or actuator is not there; MuJoCo is not installed.
    """
    mujoco = mujoco_module()
    try:
        model = mujoco.MjModel.from_xml_path(path)
    except ValueError as error:
        raise ShotError("MuJoCo cannot read the file", path=path, found=str(error)) from error
    inner = max(1, int(np.ceil(float(times[1] - times[0]) / min(step, model.opt.timestep) - 1e-9)))
    joints = [_found(model.joint, path, motor.prim_path, "joint") for motor in character.motors]
    actuators = [_actuator(mujoco, model, int(joint.id), path) for joint in joints]
    bodies = [_found(model.body, path, character.bodies[target.body].path, "body").id for target in character.targets]
    places = [int(joint.qposadr[0]) for joint in joints]
    found = places, actuators, list(zip(bodies, character.targets, strict=True))
    coarse, fine = (_played(mujoco, model, found, times, commands, parts) for parts in (inner, 2 * inner))
    return PlayedMotion(
        2.0 * fine.motor_values - coarse.motor_values, 2.0 * fine.target_positions - coarse.target_positions
    )


def _played(
    mujoco: Any,
    model: Any,
    found: tuple[list[int], list[int], list[tuple[int, Target]]],
    times: Array,
    commands: Array,
    inner: int,
) -> PlayedMotion:
    """The motion by so many steps between two times; the places of the joints, their actuators, and bodies' targets."""
    places, actuators, ends = found
    model.opt.timestep = float(times[1] - times[0]) / inner
    zero, gear = model.qpos0[places], model.actuator_gear[actuators, 0]
    data, curve = mujoco.MjData(model), CubicSpline(times, commands)
    data.qpos[places] = zero + commands[0]
    data.ctrl[actuators] = gear * (zero + commands[0])
    for _ in range(round(_SETTLES / model.opt.timestep)):
        mujoco.mj_step(model, data)
        if np.abs(data.qvel).max() < _REST:
            break
    values, targets = np.zeros(commands.shape), np.zeros((len(times), len(ends), 3))
    for n, time in enumerate(times):
        mujoco.mj_kinematics(model, data)
        values[n] = data.qpos[places] - zero
        for k, (body, target) in enumerate(ends):
            targets[n, k] = data.xpos[body] + data.xmat[body].reshape(3, 3) @ target.frame.position
        for i in range(inner if n + 1 < len(times) else 0):
            data.ctrl[actuators] = gear * (zero + curve(time + (i + 0.5) * model.opt.timestep))
            mujoco.mj_step(model, data)
    return PlayedMotion(values, targets)


def _found(of: Any, path: str, prim: str, kind: str) -> Any:
    """The joint or body of a prim's name."""
    name = prim.rsplit("/", 1)[-1]
    try:
        return of(name)
    except KeyError as error:
        raise ShotError(
            f"the MJCF file has no {kind} of this name",
            path=prim,
            found=path,
            remedy=f"Name the file from which the shot's robot was converted, with its {kind} named {name}",
        ) from error


def _actuator(mujoco: Any, model: Any, joint: int, path: str) -> int:
    """The actuator of a joint."""
    on_joints = np.isin(model.actuator_trntype, [mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT])
    found = np.flatnonzero(on_joints & (model.actuator_trnid[:, 0] == joint))
    if len(found) != 1:
        raise ShotError(
            "a joint that the shot drives has not one actuator in the MJCF file",
            path=model.joint(joint).name,
            found=f"{len(found)} in {path}",
            remedy="Give each driven joint one position actuator",
        )
    return int(found[0])
