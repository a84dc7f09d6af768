# SPDX-License-Identifier: GPL-3.0-or-later
"""Bringing an optimised animation back: the rotations of the bones that changed, as keys of a new action."""

from __future__ import annotations

import math
from pathlib import Path

import bpy
from mathutils import Matrix, Quaternion

CHANGED = 2e-5  # a bone whose rotation differs by less is as it was [rad]
_PATHS = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}


def bring_back(
    context: bpy.types.Context, armature: bpy.types.Object, root: Path
) -> tuple[bpy.types.Action, list[str]]:
    """Put the animation of a USD layer onto an armature.

    The action that it had is kept, and copied; in the copy, the curves of the bones that changed are replaced.

    Args:
        root: Layer that opens the result with its shot.

    Returns:
        The new action, and the names of the bones that changed.

    Raises:
        RuntimeError: The layer holds no armature with these bones.
    """
    scene, frame = context.scene, context.scene.frame_current
    before, names = set(bpy.data.objects), {kind: set(getattr(bpy.data, kind)) for kind in _KINDS}
    bpy.ops.wm.usd_import(
        filepath=str(root), import_meshes=False, import_materials=False, import_cameras=False, import_lights=False,
        set_frame_range=False,
    )  # fmt: skip
    imported = [obj for obj in bpy.data.objects if obj not in before]
    try:
        source = _matching(imported, armature)
        frames = range(scene.frame_start, scene.frame_end + 1)
        new: dict[str, list[Quaternion]] = {bone.name: [] for bone in armature.pose.bones}
        old: dict[str, list[Quaternion]] = {bone.name: [] for bone in armature.pose.bones}
        for number in frames:
            scene.frame_set(number)
            for bone in armature.pose.bones:
                new[bone.name].append(_basis(armature, source, bone.name).to_quaternion())
                old[bone.name].append(_basis(armature, armature, bone.name).to_quaternion())
        changed = [name for name in new if max(map(_apart, old[name], new[name])) > CHANGED]
        return _key(armature, {name: new[name] for name in changed}, frames), changed
    finally:
        _remove(imported, names)
        scene.frame_set(frame)


_KINDS = ("armatures", "actions", "meshes", "materials")


def _matching(imported: list[bpy.types.Object], armature: bpy.types.Object) -> bpy.types.Object:
    wanted = set(armature.pose.bones.keys())
    for obj in imported:
        if obj.type == "ARMATURE" and wanted <= set(obj.pose.bones.keys()):
            return obj
    raise RuntimeError("the optimised layer holds no armature with the bones of this one")


def _basis(armature: bpy.types.Object, source: bpy.types.Object, name: str) -> Matrix:
    """The transform of a bone from its rest, by the rests of the armature and the pose of the source."""
    bone, posed = armature.data.bones[name], source.pose.bones
    if bone.parent is None:
        return bone.matrix_local.inverted() @ posed[name].matrix
    rest = bone.parent.matrix_local.inverted() @ bone.matrix_local
    return rest.inverted() @ posed[bone.parent.name].matrix.inverted() @ posed[name].matrix


def _apart(one: Quaternion, other: Quaternion) -> float:
    """Angle between two rotations; exact also where it is small."""
    difference = one.rotation_difference(other)
    return 2.0 * math.atan2(math.sqrt(sum(c * c for c in difference[1:])), abs(difference[0]))


def _key(armature: bpy.types.Object, rotations: dict[str, list[Quaternion]], frames: range) -> bpy.types.Action:
    """A copy of the armature's action in which bones have these rotations."""
    data = armature.animation_data or armature.animation_data_create()
    slot = getattr(getattr(data, "action_slot", None), "identifier", None)
    if data.action is not None:
        action = data.action.copy()
        action.name = f"{data.action.name}_calm"
    else:
        action = bpy.data.actions.new(f"{armature.name}_calm")
    action.use_fake_user = True
    data.action = action
    if slot is not None:  # from Blender 4.4 on, an action holds the curves of several things
        data.action_slot = next((s for s in action.slots if s.identifier == slot), None)
    for name, turns in rotations.items():
        bone = armature.pose.bones[name]
        path = _PATHS.get(bone.rotation_mode, "rotation_euler")
        _forget(action, data, bone.path_from_id(path))
        previous = None
        for frame, turn in zip(frames, turns, strict=True):
            previous = _set(bone, path, turn, previous)
            bone.keyframe_insert(path, frame=frame, group=name)
    return action


def _set(bone: bpy.types.PoseBone, path: str, turn: Quaternion, previous: object) -> object:
    """Turn a bone as its mode has it, near the previous value; that value."""
    if path == "rotation_quaternion":
        value = turn.copy()
        if previous is not None:
            value.make_compatible(previous)
        bone.rotation_quaternion = value
        return value
    if path == "rotation_axis_angle":
        axis, angle = turn.to_axis_angle()
        bone.rotation_axis_angle = (angle, *axis)
        return None
    euler = turn.to_euler(bone.rotation_mode, previous) if previous is not None else turn.to_euler(bone.rotation_mode)
    bone.rotation_euler = euler
    return euler


def _forget(action: bpy.types.Action, data: bpy.types.AnimData, path: str) -> None:
    """Remove the curves of a property from an action."""
    if hasattr(action, "layers"):
        bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
        bags = [bag for bag in bags if bag.slot == data.action_slot]
    else:
        bags = [action]
    for bag in bags:
        for curve in [curve for curve in bag.fcurves if curve.data_path == path]:
            bag.fcurves.remove(curve)


def _remove(imported: list[bpy.types.Object], names: dict[str, set]) -> None:
    """Take away what the import made."""
    for obj in imported:
        bpy.data.objects.remove(obj, do_unlink=True)
    for kind, kept in names.items():
        for block in [block for block in getattr(bpy.data, kind) if block not in kept and block.users == 0]:
            getattr(bpy.data, kind).remove(block)
