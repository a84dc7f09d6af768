"""A robot of rigid bodies on position actuators in MuJoCo: another program's model of the same motors.

Its bodies, joints and motors are written as MJCF from a character, so that it shares no equation with Calmotion: a
tree of bodies with `armature`, `damping` and `position` actuators (`kp`, `kv`), which are commanded theta_c as it is.
The `kv` of such an actuator acts on the joint's own velocity. A motor whose controller is sent velocities has in place
of it a `velocity` actuator, which is commanded theta_c'. Coulomb friction is applied smoothed, as the model of the shot
has it.
"""

import xml.etree.ElementTree as xml
from dataclasses import dataclass
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import ON_ERROR, PRESCRIBED, WORLD, Character, Frame, Motor
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

MUJOCO_STEP = 1e-4  # of its implicit integrator [s]
_KINDS = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball"}


@dataclass(frozen=True, eq=False)
class PlayedMotion:
    """What the robot does in MuJoCo.

    Attributes:
        motor_values: Of the joints that are driven [rad or m], shape [T, M].
        target_positions: [m], shape [T, K, 3].
    """

    motor_values: Array
    target_positions: Array


def lumped_mjcf(character: Character, step: float = MUJOCO_STEP) -> str:
    """The robot as MJCF, for bodies without flexible links.

    Args:
        step: Of the integrator [s].

    Raises:
        ShotError: It has closed chains, flexible links, motors geared to others or ideal ones, or gears that give.
    """
    _refuse(character)
    root = xml.Element("mujoco", model="lumped")
    xml.SubElement(root, "compiler", angle="radian", inertiafromgeom="false", autolimits="false")
    gravity = _text(character.gravity)
    option = xml.SubElement(root, "option", gravity=gravity, timestep=repr(step), integrator="implicit")
    xml.SubElement(option, "flag", contact="disable", limit="disable")
    world = xml.SubElement(root, "worldbody")
    elements: dict[int, xml.Element] = {WORLD: world}
    motor_of = {motor.joint: (k, motor) for k, motor in enumerate(character.motors)}
    for _ in character.joints:  # another level of the tree each time
        for k, joint in enumerate(character.joints):
            if joint.body0 in elements and joint.body1 not in elements:
                elements[joint.body1] = _body(elements[joint.body0], character, k, motor_of.get(k))
    actuators = xml.SubElement(root, "actuator")
    for k, motor in enumerate(character.motors):
        damping = {} if motor.damping_on == ON_ERROR else _damping(motor)
        xml.SubElement(actuators, "position", {"joint": f"motor{k}", "kp": repr(float(motor.position_gain))} | damping)
    for k in _sent_velocities(character):
        xml.SubElement(actuators, "velocity", {"joint": f"motor{k}"} | _damping(character.motors[k]))
    return xml.tostring(root, encoding="unicode")


def simulate_lumped(character: Character, times: Array, commands: Array, step: float = MUJOCO_STEP) -> PlayedMotion:
    """The robot on commands, from the rest in which its motors hold it at their first ones.

    Args:
        times: Equidistant [s], shape [T].
        commands: Of its motors, shape [T, M]; splines between the times.
        step: Of MuJoCo [s]; it is shortened to divide those of the times.

    Raises:
        ShotError: See `lumped_mjcf`; MuJoCo is not installed.
    """
    mujoco = mujoco_module()
    h = float(times[1] - times[0])
    inner = max(1, int(np.ceil(h / step - 1e-9)))
    model = mujoco.MjModel.from_xml_string(lumped_mjcf(character, h / inner))
    data, motors = mujoco.MjData(model), character.motors
    places, dofs = (
        [int(getattr(model.joint(f"motor{k}"), key)[0]) for k in range(len(motors))] for key in ("qposadr", "dofadr")
    )
    position = np.array([m.position_gain for m in motors])
    friction = np.array([m.rotor.friction for m in motors])
    width = np.array([m.rotor.friction_speed for m in motors])
    curve = CubicSpline(times, commands)
    late = np.array([m.delay for m in motors])
    sent = _sent_velocities(character)

    def command(t: float) -> Array:
        at = np.clip(t - late, times[0], times[-1])
        rate = np.where(t - late > times[0], np.diag(curve(at, 1)), 0.0)
        return np.concatenate([np.diag(curve(at)), rate[sent]])

    data.qpos[places] = commands[0]
    for _ in range(_STATIC):
        data.qvel[:] = 0.0
        mujoco.mj_forward(model, data)
        data.qpos[places] = commands[0] - data.qfrc_bias[dofs] / position
    joints, targets = np.zeros((len(times), len(motors))), np.zeros((len(times), len(character.targets), 3))
    for n in range(len(times)):
        mujoco.mj_kinematics(model, data)
        joints[n] = data.qpos[places]
        for k, target in enumerate(character.targets):
            body = data.body(f"body{target.body}")
            targets[n, k] = body.xpos + body.xmat.reshape(3, 3) @ target.frame.position
        for i in range(inner if n + 1 < len(times) else 0):
            data.ctrl[:] = command(times[n] + (i + 0.5) * h / inner)
            if friction.any():
                data.qfrc_applied[dofs] = -friction * np.tanh(data.qvel[dofs] / width)
            mujoco.mj_step(model, data)
    return PlayedMotion(joints, targets)


def _sent_velocities(character: Character) -> list[int]:
    """The motors whose controllers know the velocity of their command."""
    return [k for k, motor in enumerate(character.motors) if motor.damping_on == ON_ERROR]


def _damping(motor: Motor) -> dict[str, str]:
    return {"kv": repr(float(motor.velocity_gain))}


_STATIC = 200  # iterations of the static start


def _body(parent: xml.Element, character: Character, number: int, driven: tuple[int, Motor] | None) -> xml.Element:
    """The body beyond a joint, with the joint."""
    joint = character.joints[number]
    mass = character.bodies[joint.body1].mass
    assert mass is not None
    turn = _rotation(joint.frame0) * _rotation(joint.frame1).inv()
    place = joint.frame0.position - turn.apply(joint.frame1.position)
    element = xml.SubElement(parent, "body", name=f"body{joint.body1}", pos=_text(place), quat=_quaternion(turn))
    i = mass.inertia
    tensor = _text([i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]])
    xml.SubElement(element, "inertial", pos=_text(mass.center), mass=repr(float(mass.mass)), fullinertia=tensor)
    if joint.kind != "fixed":
        axis = _rotation(joint.frame1).apply([0.0, 0.0, 1.0])
        more: dict[str, str] = {"axis": _text(axis)} if joint.kind != "spherical" else {}
        if driven is not None:
            rotor = driven[1].rotor
            more |= {"armature": repr(rotor.armature), "damping": repr(rotor.viscous_friction + rotor.back_emf)}
            limit = driven[1].max_torque
            if np.isfinite(limit):
                more |= {"actuatorfrcrange": _text([-limit, limit]), "actuatorfrclimited": "true"}
        name = f"joint{number}" if driven is None else f"motor{driven[0]}"
        place_of = {"name": name, "type": _KINDS[joint.kind], "pos": _text(joint.frame1.position)}
        xml.SubElement(element, "joint", place_of | more)
    return element


def _refuse(character: Character) -> None:
    """Take only rigid bodies in a tree, whose motors have gains and stiff gears of their own."""
    carried = [joint.body1 for joint in character.joints]
    unfit = [
        joint.path for k, joint in enumerate(character.joints) if joint.closes_chain or carried.index(joint.body1) < k
    ]
    unfit += [body.path for body in character.bodies if body.mass is None or body.flexible is not None]
    unfit += [
        motor.path
        for motor in character.motors
        if motor.model == PRESCRIBED or motor.follows is not None or np.isfinite(motor.rotor.gear_stiffness)
    ]
    if unfit:
        raise ShotError(
            "has no place in the lumped model",
            path=unfit[0],
            remedy="Compare a robot of rigid bodies in a tree, whose motors have gains",
        )


def mujoco_module() -> Any:
    """MuJoCo; raises a ShotError where it is not installed."""
    try:
        import mujoco
    except ImportError as error:
        raise ShotError(
            "MuJoCo is not installed", found=str(error), remedy="Install it: pip install exudyn mujoco"
        ) from error
    return mujoco


def _rotation(frame: Frame) -> Rotation:
    return Rotation.from_quat(frame.rotation, scalar_first=True)


def _quaternion(rotation: Rotation) -> str:
    return _text(rotation.as_quat(scalar_first=True))


def _text(values: Any) -> str:
    return " ".join(repr(float(value)) for value in values)
