# SPDX-License-Identifier: GPL-3.0-or-later
"""A skinned arm that waves, to try the extension with: open this file in Blender's Scripting workspace and run it.

The pictures and the tests of the extension use it as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
from mathutils import Vector

BONES, LENGTH, SIDES, FRAMES = ("foot", "upper", "hand"), 0.42, 20, 48


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


def radius(x: float) -> float:
    """Radius of the skin at a distance from the foot [m]."""
    tip, ball = len(BONES) * LENGTH, 0.05
    if x > tip - 2.0 * ball:
        return math.sqrt(max(ball**2 - (x - tip + ball) ** 2, 0.018**2 if x < tip - ball else 0.0))
    return 0.055 if x < 0.12 else 0.030 if abs(x - LENGTH) < 0.035 or abs(x - 2 * LENGTH) < 0.03 else 0.018


def skin() -> bpy.types.Mesh:
    """A closed surface of revolution along z."""
    tip = len(BONES) * LENGTH
    round_tip = (tip - 0.05 + 0.05 * math.sin(0.13 * k) for k in range(-12, 13))
    heights = sorted({*(tip * k / 60 for k in range(61)), *round_tip})
    points = [(0.0, 0.0, 0.0)]
    for z in heights[:-1]:
        size = max(radius(z), 0.004)
        points += [(size * math.cos(a), size * math.sin(a), z) for a in (2 * math.pi * k / SIDES for k in range(SIDES))]
    points.append((0.0, 0.0, tip))
    rings, last = len(heights) - 1, len(points) - 1
    sides = [(r * SIDES + 1 + k, r * SIDES + 1 + (k + 1) % SIDES) for r in range(rings) for k in range(SIDES)]
    faces = [(a, b, b + SIDES, a + SIDES) for a, b in sides[: (rings - 1) * SIDES]]
    faces += [(0, 1 + (k + 1) % SIDES, 1 + k) for k in range(SIDES)]
    faces += [(a, b, last) for a, b in sides[(rings - 1) * SIDES :]]
    mesh = bpy.data.meshes.new("Skin")
    mesh.from_pydata(points, [], faces)
    mesh.shade_smooth()
    return mesh


def waving_arm() -> bpy.types.Object:
    """An arm in the scene that swings to the side and stops, twice; it is selected."""
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, FRAMES, 24
    bpy.ops.object.select_all(action="DESELECT")
    rig = rigged(BONES, Vector((0.0, 0.0, 0.0)), Vector((0.0, 0.0, LENGTH)), skin())
    for frame in range(1, FRAMES + 1):
        for name, size, start in (("upper", 0.6, 5), ("hand", 0.8, 7)):
            share = smooth((frame - start) / 8.0) - smooth((frame - start - 20) / 8.0)
            bone = rig.pose.bones[name]
            bone.rotation_mode = "XYZ"
            bone.rotation_euler = (size * (share - 0.5), 0.0, 0.0)
            bone.keyframe_insert("rotation_euler", frame=frame)
    rig.select_set(True)
    return rig


def smooth(share: float) -> float:
    """A step without corners."""
    share = min(max(share, 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


if __name__ == "__main__":
    waving_arm()
