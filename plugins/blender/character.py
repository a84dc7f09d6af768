# SPDX-License-Identifier: GPL-3.0-or-later
"""Exporting the character with Blender's own exporter."""

from __future__ import annotations

from pathlib import Path

import bpy


def armature_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The armature that is selected, or that what is selected belongs to."""
    for obj in (context.active_object, *context.selected_objects):
        while obj is not None:
            if obj.type == "ARMATURE":
                return obj
            found = obj.find_armature()
            obj = found if found is not None else obj.parent
    return None


def export_character(context: bpy.types.Context, armature: bpy.types.Object, path: Path) -> Path:
    """Write an armature and what it moves, with its animation, in metres; the selection stays as it was."""
    active, selected = context.view_layer.objects.active, list(context.selected_objects)
    moved = [obj for obj in context.scene.objects if obj.find_armature() is armature or obj.parent is armature]
    try:
        for obj in selected:
            obj.select_set(False)
        for obj in (armature, *moved):
            obj.select_set(True)
        context.view_layer.objects.active = armature
        bpy.ops.wm.usd_export(
            filepath=str(path), selected_objects_only=True, export_animation=True, export_armatures=True,
            export_materials=False, convert_scene_units="METERS", evaluation_mode="RENDER",
        )  # fmt: skip
    finally:
        for obj in (armature, *moved):
            obj.select_set(False)
        for obj in selected:
            obj.select_set(True)
        context.view_layer.objects.active = active
    return path
