# SPDX-License-Identifier: GPL-3.0-or-later
"""A skinned armature in a line, as the pictures and the tests of the extension animate it."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
from mathutils import Vector


def rigged(bones: Sequence[str], start: Vector, step: Vector, mesh: bpy.types.Mesh) -> bpy.types.Object:
    """An armature in the scene with an empty action, whose bones carry a skin rigidly.

    Args:
        bones: Names, from the first bone on.
        start: Head of the first bone.
        step: From the head of a bone to its tail, where the next one begins.
        mesh: The skin; each vertex belongs to the bone beside it.
    """
    scene = bpy.context.scene
    armature = bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", armature)
    scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    above = None
    for k, name in enumerate(bones):
        bone = armature.edit_bones.new(name)
        bone.head, bone.tail, bone.parent = start + k * step, start + (k + 1) * step, above
        above = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    skin = bpy.data.objects.new("Skin", mesh)
    scene.collection.objects.link(skin)
    for name in bones:
        skin.vertex_groups.new(name=name)
    for vertex in mesh.vertices:
        along = (vertex.co - start).dot(step) / step.length_squared
        owner = min(len(bones) - 1, int(along - 1e-6))
        skin.vertex_groups[bones[owner]].add([vertex.index], 1.0, "REPLACE")
    skin.parent = rig
    skin.modifiers.new("Armature", "ARMATURE").object = rig
    rig.animation_data_create()
    rig.animation_data.action = bpy.data.actions.new("Wave")
    return rig
