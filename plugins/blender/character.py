# SPDX-License-Identifier: GPL-3.0-or-later
"""Exporting the character with Blender's own exporter."""

from __future__ import annotations

import re
from pathlib import Path

import bpy

_METERS_PER_UNIT = re.compile(r"^    metersPerUnit = .*$", re.MULTILINE)


def character_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The selected character: its armature, or the topmost parent of animated objects."""
    for obj in (context.active_object, *context.selected_objects):
        top = obj
        while obj is not None:
            if obj.type == "ARMATURE":
                return obj
            armature = obj.find_armature()
            top, obj = obj, armature if armature is not None else obj.parent
        if top is not None and is_animated(top):
            return top
    return None


def is_animated(character: bpy.types.Object) -> bool:
    """Whether some part of a character has an action."""
    return any(part.animation_data and part.animation_data.action for part in parts_of(character))


def parts_of(character: bpy.types.Object) -> list[bpy.types.Object]:
    """A character and all objects that it moves, parents first."""
    parts = [character, *character.children_recursive]
    moved = [obj for obj in bpy.context.scene.objects if obj not in parts and obj.find_armature() is character]
    return parts + moved if character.type == "ARMATURE" else parts


def links_of(character: bpy.types.Object) -> list[str]:
    """What can be flexible: the bones of an armature with a skin, else the objects that have geometry."""
    parts = parts_of(character)
    if any(part.find_armature() is character for part in parts):
        return [bone.name for bone in character.data.bones]
    return [part.name for part in parts if part.type == "MESH"]


def exported_name(name: str) -> str:
    """The name of a bone or an object as Blender's exporter writes it, since USD allows no dots (`arm.L`: `arm_L`)."""
    return re.sub(r"^(?=\d)", "_", re.sub(r"\W", "_", name))


def export_character(context: bpy.types.Context, character: bpy.types.Object, path: Path) -> Path:
    """Write a character, with its animation, in units of the scene; the selection stays unchanged."""
    active, selected = context.view_layer.objects.active, list(context.selected_objects)
    parts = parts_of(character)
    # Before 4.3 the exporter writes the scene's scale as metersPerUnit; later it takes a unit of the scene for a metre.
    converts = "convert_scene_units" in bpy.ops.wm.usd_export.get_rna_type().properties
    units = {"convert_scene_units": "METERS"} if converts else {}
    # A matrix keeps the shear that a part has on one whose scale is not applied.
    try:
        for obj in selected:
            obj.select_set(False)
        for obj in parts:
            obj.select_set(True)
        context.view_layer.objects.active = character
        bpy.ops.wm.usd_export(
            filepath=str(path), selected_objects_only=True, export_animation=True, export_armatures=True,
            export_materials=False, evaluation_mode="RENDER", xform_op_mode="MAT", **units,
        )  # fmt: skip
    finally:
        for obj in parts:
            obj.select_set(False)
        for obj in selected:
            obj.select_set(True)
        context.view_layer.objects.active = active
    if converts:
        scale = context.scene.unit_settings.scale_length  # 0.01 in centimetres
        text = path.read_text(encoding="utf-8")
        path.write_text(_METERS_PER_UNIT.sub(f"    metersPerUnit = {scale:.9g}", text, count=1), encoding="utf-8")
    return path
