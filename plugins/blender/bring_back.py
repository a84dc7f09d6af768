# SPDX-License-Identifier: GPL-3.0-or-later
"""Importing an optimised animation: changed bones and objects get keys in new actions."""

from __future__ import annotations

from pathlib import Path

import bpy
from mathutils import Quaternion

from .character import exported_name, parts_of
from .keys import CHANGED, apart, basis_of, copied_action, discard, key_rotations, put_on, take_off
from .parts import put_on_parts


def bring_back(context: bpy.types.Context, character: bpy.types.Object, shot: Path, root: Path) -> list[str]:
    """Apply the animation of a USD layer to a character.

    Its actions are kept and copied; in the copies, the curves of changed bones and objects are replaced. The copies of
    an earlier run are removed.

    Args:
        shot: The exported character.
        root: Layer that opens the result with its shot.

    Returns:
        The names of the bones or objects that changed.

    Raises:
        RuntimeError: The layer does not contain this character, or it cannot be posed as the layer says.
    """
    scene, frame = context.scene, context.scene.frame_current
    frames, parts = range(scene.frame_start, scene.frame_end + 1), parts_of(character)
    earlier = take_off(parts)
    try:
        rigid = any(part.type != "ARMATURE" and part.find_armature() is None for part in parts)
        changed = put_on_parts(context, parts, shot, root, frames) if rigid else []
        armature = next((part for part in parts if part.type == "ARMATURE"), None)
        if not changed and armature is not None:
            changed = _put_on_armature(context, armature, root, frames)
    except BaseException:
        put_on(earlier)
        raise
    finally:
        scene.frame_set(frame)
    discard(earlier)
    return changed


def _put_on_armature(context: bpy.types.Context, armature: bpy.types.Object, root: Path, frames: range) -> list[str]:
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
        return _put_on_bones(context, armature, imported, frames)
    finally:
        _remove(imported, names)
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
            new[bone.name].append(basis_of(armature, posed, bone.name).to_quaternion())
            old[bone.name].append(basis_of(armature, armature.pose.bones, bone.name).to_quaternion())
    changed = [name for name in new if max(map(apart, old[name], new[name])) > CHANGED]
    data, action = copied_action(armature)
    for name in changed:
        bone = armature.pose.bones[name]
        key_rotations(bone, data, action, bone.path_from_id(), new[name], frames)
    return changed


_KINDS = ("armatures", "actions", "meshes", "materials")


def _matching(imported: list[bpy.types.Object], armature: bpy.types.Object) -> bpy.types.Object:
    wanted = set(map(exported_name, armature.pose.bones.keys()))
    if len(wanted) < len(armature.pose.bones):
        raise RuntimeError("two bones have the same name but for dots and spaces, which USD does not allow: rename one")
    for obj in imported:
        if obj.type == "ARMATURE" and wanted <= set(obj.pose.bones.keys()):
            return obj
    raise RuntimeError("the optimised layer contains no armature with the bones of this one")


def _remove(imported: list[bpy.types.Object], names: dict[str, set]) -> None:
    """Remove the imported objects."""
    for obj in imported:
        bpy.data.objects.remove(obj, do_unlink=True)
    for kind, kept in names.items():
        for block in [block for block in getattr(bpy.data, kind) if block not in kept and block.users == 0]:
            getattr(bpy.data, kind).remove(block)
