"""A robot in its own MJCF file, on commands exactly as they are written: another program, and a model that is not ours.

Masses, armature, friction, limits of force, contacts and the integrator are those of the file. Its actuators are set to
the commands, whatever they then do with them; joints and bodies are found by their names.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Character
from scipy.interpolate import CubicSpline

from .lumped_robot import MUJOCO_STEP, PlayedMotion, mujoco_module

_SETTLES = 20.0  # longest time in which the robot comes to rest at its first commands [s]
_REST = 1e-6  # [rad/s or m/s]


def simulate_original(
    path: str, character: Character, times: Array, commands: Array, step: float = MUJOCO_STEP
) -> PlayedMotion:  # fmt: skip
    """The robot of an MJCF file on commands, from the rest in which its actuators hold it at their first ones.

    Args:
        path: The file.
        character: The shot's robot, for the names of the joints that are driven and for its targets.
        times: Equidistant [s], shape [T].
        commands: Of its motors, shape [T, M]; splines between the times.
        step: Of MuJoCo [s]; it is shortened to divide those of the times, and to what the file has.

    Raises:
        ShotError: The file cannot be read, or a joint, body or actuator is not there; MuJoCo is not installed.
    """
    mujoco = mujoco_module()
    try:
        model = mujoco.MjModel.from_xml_path(path)
    except ValueError as error:
        raise ShotError("MuJoCo cannot read the file", path=path, found=str(error)) from error
    spacing = float(times[1] - times[0])
    inner = max(1, int(np.ceil(spacing / min(step, model.opt.timestep) - 1e-9)))
    model.opt.timestep = spacing / inner
    joints = [_found(model.joint, path, motor.prim_path, "joint") for motor in character.motors]
    actuators = [_actuator(mujoco, model, int(joint.id), path) for joint in joints]
    bodies = [
        _found(model.body, path, character.bodies[target.body].path, "body").id for target in character.targets
    ]  # fmt: skip
    places = [int(joint.qposadr[0]) for joint in joints]
    zero, gear = model.qpos0[places], model.actuator_gear[actuators, 0]
    data, curve = mujoco.MjData(model), CubicSpline(times, commands)
    data.qpos[places] = zero + commands[0]
    data.ctrl[actuators] = gear * (zero + commands[0])
    for _ in range(round(_SETTLES / model.opt.timestep)):
        mujoco.mj_step(model, data)
        if np.abs(data.qvel).max() < _REST:
            break
    values, targets = np.zeros(commands.shape), np.zeros((len(times), len(bodies), 3))
    for n, time in enumerate(times):
        mujoco.mj_kinematics(model, data)
        values[n] = data.qpos[places] - zero
        for k, (body, target) in enumerate(zip(bodies, character.targets, strict=True)):
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
