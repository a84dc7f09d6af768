# SPDX-License-Identifier: GPL-3.0-or-later
"""Importing an optimised animation: changed bones and objects get keys in new actions."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path

import bpy
from mathutils import Matrix, Quaternion

from .character import exported_name

CHANGED = 2e-5  # a smaller difference counts as unchanged [rad or m]
_PATHS = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}


def bring_back(context: bpy.types.Context, character: bpy.types.Object, root: Path) -> list[str]:
    """Apply the animation of a USD layer to a character.

    Its actions are kept and copied; in the copies, the curves of changed bones and objects are replaced.

    Args:
        root: Layer that opens the result with its shot.

    Returns:
        The names of the bones or objects that changed.

    Raises:
        RuntimeError: The layer does not contain this character.
    """
    scene, frame = context.scene, context.scene.frame_current
    active, selected = context.view_layer.objects.active, list(context.selected_objects)
    before, names = set(bpy.data.objects), {kind: set(getattr(bpy.data, kind)) for kind in _KINDS}
    # From 4.3 on the importer takes a unit of the scene for a metre; the layer has those of the scene.
    converts = "apply_unit_conversion_scale" in bpy.ops.wm.usd_import.get_rna_type().properties
    units = {"apply_unit_conversion_scale": False} if converts else {}
    bpy.ops.wm.usd_import(
        filepath=str(root), import_meshes=False, import_materials=False, import_cameras=False, import_lights=False,
        set_frame_range=False, **units,
    )  # fmt: skip
    imported = [obj for obj in bpy.data.objects if obj not in before]
    try:
        frames = range(scene.frame_start, scene.frame_end + 1)
        put = _put_on_bones if character.type == "ARMATURE" else _put_on_objects
        return put(context, character, imported, frames)
    finally:
        _remove(imported, names)
        scene.frame_set(frame)
        for obj in selected:  # the importer selects what it adds
            obj.select_set(True)
        context.view_layer.objects.active = active


def _put_on_bones(
    context: bpy.types.Context, armature: bpy.types.Object, imported: list[bpy.types.Object], frames: range
) -> list[str]:
    source = _matching(imported, armature).pose.bones
    posed = {bone.name: source[exported_name(bone.name)] for bone in armature.pose.bones}
    new: dict[str, list[Quaternion]] = {bone.name: [] for bone in armature.pose.bones}
    old: dict[str, list[Quaternion]] = {bone.name: [] for bone in armature.pose.bones}
    for number in frames:
        context.scene.frame_set(number)
        for bone in armature.pose.bones:
            new[bone.name].append(_basis(armature, posed, bone.name).to_quaternion())
            old[bone.name].append(_basis(armature, armature.pose.bones, bone.name).to_quaternion())
    changed = [name for name in new if max(map(_apart, old[name], new[name])) > CHANGED]
    data, action = _copied_action(armature)
    for name in changed:
        bone = armature.pose.bones[name]
        _key_rotations(bone, data, action, bone.path_from_id(), new[name], frames)
    return changed


def _put_on_objects(
    context: bpy.types.Context, top: bpy.types.Object, imported: list[bpy.types.Object], frames: range
) -> list[str]:
    """Imported transforms come from a cache file, so they are read frame by frame."""
    parts = [top, *top.children_recursive]
    sources = {exported_name(re.sub(r"\.\d{3}$", "", obj.name)): obj for obj in imported}
    pairs = [(part, sources[exported_name(part.name)]) for part in parts if exported_name(part.name) in sources]
    if not pairs:
        raise RuntimeError("the optimised layer contains no object of this character")
    new: dict[str, list[Matrix]] = {part.name: [] for part, _ in pairs}
    old: dict[str, list[Matrix]] = {part.name: [] for part, _ in pairs}
    for number in frames:
        context.scene.frame_set(number)
        graph = context.evaluated_depsgraph_get()
        worlds = {part.name: source.evaluated_get(graph).matrix_world.copy() for part, source in pairs}
        for part, _ in pairs:
            above = part.parent.matrix_world if part.parent else Matrix()
            parent_world = worlds.get(part.parent.name, above) if part.parent else above
            new[part.name].append((parent_world @ part.matrix_parent_inverse).inverted() @ worlds[part.name])
            old[part.name].append(part.matrix_basis.copy())
    changed = [name for name in new if any(_differ(a, b) for a, b in zip(old[name], new[name], strict=True))]
    for name in changed:
        part = bpy.data.objects[name]
        data, action = _copied_action(part)
        _key_rotations(part, data, action, "", [matrix.to_quaternion() for matrix in new[name]], frames)
        _forget(action, data, "location")
        for number, matrix in zip(frames, new[name], strict=True):
            part.location = matrix.to_translation()
            part.keyframe_insert("location", frame=number)
    return changed


def _differ(one: Matrix, other: Matrix) -> bool:
    far = (one.to_translation() - other.to_translation()).length
    return far > CHANGED or _apart(one.to_quaternion(), other.to_quaternion()) > CHANGED


_KINDS = ("armatures", "actions", "meshes", "materials")


def _matching(imported: list[bpy.types.Object], armature: bpy.types.Object) -> bpy.types.Object:
    wanted = set(map(exported_name, armature.pose.bones.keys()))
    if len(wanted) < len(armature.pose.bones):
        raise RuntimeError("two bones have the same name but for dots and spaces, which USD does not allow: rename one")
    for obj in imported:
        if obj.type == "ARMATURE" and wanted <= set(obj.pose.bones.keys()):
            return obj
    raise RuntimeError("the optimised layer contains no armature with the bones of this one")


def _basis(armature: bpy.types.Object, posed: Mapping[str, bpy.types.PoseBone], name: str) -> Matrix:
    """The transform of a bone from its rest, by the rests of the armature and bones in a pose, by their names in it."""
    bone = armature.data.bones[name]
    if bone.parent is None:
        return bone.matrix_local.inverted() @ posed[name].matrix
    rest = bone.parent.matrix_local.inverted() @ bone.matrix_local
    return rest.inverted() @ posed[bone.parent.name].matrix.inverted() @ posed[name].matrix


def _apart(one: Quaternion, other: Quaternion) -> float:
    """Angle between two rotations; exact also where it is small."""
    difference = one.rotation_difference(other)
    return 2.0 * math.atan2(math.sqrt(sum(c * c for c in difference[1:])), abs(difference[0]))


def _copied_action(obj: bpy.types.Object) -> tuple[bpy.types.AnimData, bpy.types.Action]:
    """A copy of an object's action, which takes its place; a new one where it had none."""
    data = obj.animation_data or obj.animation_data_create()
    slot = getattr(getattr(data, "action_slot", None), "identifier", None)
    if data.action is not None:
        action = data.action.copy()
        action.name = f"{data.action.name}_calm"
        data.action.use_fake_user = True
    else:
        action = bpy.data.actions.new(f"{obj.name}_calm")
    data.action = action
    if slot is not None:  # from Blender 4.4 on, an action holds the curves of several things
        data.action_slot = next((s for s in action.slots if s.identifier == slot), None)
    return data, action


def _key_rotations(
    target: bpy.types.PoseBone | bpy.types.Object, data: bpy.types.AnimData, action: bpy.types.Action, place: str,
    turns: list[Quaternion], frames: range,
) -> None:  # fmt: skip
    """Key the rotation of a bone or an object at every frame, in place of the curves that it had.

    Args:
        place: Path of the bone within the armature; empty for an object.
    """
    name = _PATHS.get(target.rotation_mode, "rotation_euler")
    _forget(action, data, f"{place}.{name}".lstrip("."))
    previous = None
    for frame, turn in zip(frames, turns, strict=True):
        previous = _set(target, name, turn, previous)
        target.keyframe_insert(name, frame=frame)


def _set(bone: bpy.types.PoseBone | bpy.types.Object, path: str, turn: Quaternion, previous: object) -> object:
    """Set the rotation of a bone in its rotation mode, near the previous value; returns the value."""
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
    """Remove the imported objects."""
    for obj in imported:
        bpy.data.objects.remove(obj, do_unlink=True)
    for kind, kept in names.items():
        for block in [block for block in getattr(bpy.data, kind) if block not in kept and block.users == 0]:
            getattr(bpy.data, kind).remove(block)
