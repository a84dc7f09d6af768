"""Motor curves as joint rotations of the UsdSkel animation that they came from."""

import numpy as np
from pxr import Sdf, Usd, UsdSkel, Vt

from calmotion.arrays import Array
from calmotion.model import Animation, Character, MotorCurve
from calmotion.model.curves import curve_of
from calmotion.support.rotations import quaternion_from_rotation
from calmotion.usd import gf
from calmotion.usd.clock import Clock
from calmotion.usd.reading.character import read_skeleton
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.motors.skeletal_motors import HingeStack, hinge_stacks
from calmotion.usd.transforms import pose_from_matrix
from calmotion.usd.units import units_of
from calmotion.usd.writing.curves import attribute_spec, curve_values


def author_skeletons(
    layer: Sdf.Layer,
    stage: Usd.Stage,
    character: Character,
    animation: Animation,
    curves: tuple[MotorCurve, ...],
    times: Array,
    clock: Clock,
) -> None:
    """Author the rotations of every SkelAnimation whose joints the curves turn; its other joints keep theirs.

    What the motors cannot follow of a joint is kept: its rotation L becomes D(new) D(old)^T L.

    Args:
        stage: The shot, layers of ours muted.
        character, animation: The shot as read.
        curves: Those to write, all of motors whose source is a skeleton.
        times: Of the samples [s].
    """
    changed = {character.motors[curve.motor].path: curve for curve in curves}
    tempo = animation.tempo
    made = clock.time_codes(times if tempo is None else tempo.animated(times))  # when the animation is there
    reading = Reading(stage, units_of(stage), clock.start)
    drives = read_skeleton(reading, clock, still=True).drives
    index = {motor.path: k for k, motor in enumerate(character.motors)}
    turned: dict[str, list[tuple[HingeStack, Array]]] = {}
    for stack in hinge_stacks(reading, drives):
        if not any(drive.joint.path in changed for drive in stack.drives):
            continue
        old, new = (np.zeros((len(times), len(stack.drives))) for _ in range(2))
        for k, drive in enumerate(stack.drives):
            path = drive.joint.path
            track = animation.tracks[index[path]]
            old[:, k] = curve_of(track, float(animation.frame_times[-1]), character.retarget.cyclic)(times, 0)
            new[:, k] = old[:, k]
            if path in changed:
                new[:, k] = curve_values(animation, changed[path], times, character.retarget.cyclic)
        change = stack.turned(new) @ np.swapaxes(stack.turned(old), 1, 2)
        rotations = change @ stack.skeleton.local_rotations(stack.joint, made)
        turned.setdefault(str(stack.skeleton.animation.GetPath()), []).append((stack, rotations))
    for name, parts in turned.items():
        _author(layer, stage, name, parts, clock, times, made)


def _author(
    layer: Sdf.Layer, stage: Usd.Stage, name: str, parts: list[tuple[HingeStack, Array]], clock: Clock, times: Array,
    made: Array,
) -> None:  # fmt: skip
    """Write one animation.

    Args:
        times: Of the samples [s].
        made: Time codes of the shot with what these show.
    """
    animation = UsdSkel.Animation(stage.GetPrimAtPath(name))
    joints = [str(joint) for joint in animation.GetJointsAttr().Get()]
    more = [stack for stack, _ in parts if stack.skeleton.joints[stack.joint] not in joints]
    rotations = attribute_spec(layer, f"{name}.rotations", Sdf.ValueTypeNames.QuatfArray)
    last: dict[int, Array] = {}
    for n, code in enumerate(clock.time_codes(times)):
        found = gf.quaternions(animation.GetRotationsAttr().Get(float(made[n])))
        found = np.concatenate([found, [_at_rest(stack) for stack in more]]) if more else found
        for stack, turns in parts:
            token = stack.skeleton.joints[stack.joint]
            k = joints.index(token) if token in joints else len(joints) + more.index(stack)
            # neighbours of the same sign, as USD interpolates between them
            near = last.get(k, found[k])
            quaternion = quaternion_from_rotation(turns[n])
            found[k] = last[k] = quaternion if quaternion @ near >= 0.0 else -quaternion
        layer.SetTimeSample(rotations.path, float(code), gf.to_quaternions(found))
    if more:
        _lengthen(layer, animation, name, joints, more, clock)


def _at_rest(stack: HingeStack) -> Array:
    rest = pose_from_matrix(stack.skeleton.rest[stack.joint], stack.drives[0].joint.path)
    return quaternion_from_rotation(rest.rotation)


def _lengthen(
    layer: Sdf.Layer, animation: UsdSkel.Animation, name: str, joints: list[str], more: list[HingeStack], clock: Clock
) -> None:
    """Add joints that the animation did not have, at rest but for their rotations."""
    names = [*joints, *(stack.skeleton.joints[stack.joint] for stack in more)]
    attribute_spec(layer, f"{name}.joints", Sdf.ValueTypeNames.TokenArray, uniform=True).default = Vt.TokenArray(names)
    rests = np.array([stack.skeleton.rest[stack.joint] for stack in more])
    for attribute, kind, extra in (
        (animation.GetTranslationsAttr(), Sdf.ValueTypeNames.Float3Array, rests[:, :3, 3]),
        (animation.GetScalesAttr(), Sdf.ValueTypeNames.Half3Array, np.linalg.norm(rests[:, :3, :3], axis=1)),
    ):
        spec = attribute_spec(layer, f"{name}.{attribute.GetName()}", kind)
        for code in attribute.GetTimeSamples() or [clock.start]:
            values = gf.points(attribute.Get(code))
            layer.SetTimeSample(spec.path, float(code), gf.to_vectors(np.concatenate([values, extra]), kind))
