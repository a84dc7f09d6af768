# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders what the extension shows of an arm that waves: `make blender-pictures`.

Run by Blender's Python with the folder of the extension and a folder for the frames; CALMOTION_COMMAND starts
calmotion.
"""

from __future__ import annotations

import importlib
import importlib.util
import math
import sys
from pathlib import Path

import bpy
from mathutils import Vector

BONES, LENGTH, SIDES, FRAMES = ("foot", "upper", "hand"), 0.42, 20, 48
SIZE, SAMPLES, EVERY = (520, 380), 10, 3


def extension(folder: Path) -> None:
    """Register the extension from its folder."""
    spec = importlib.util.spec_from_file_location(
        "calmotion_extension", folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules["calmotion_extension"] = module
    spec.loader.exec_module(module)
    module.register()


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


def character() -> bpy.types.Object:
    """An armature with a skin that swings to the side and stops, twice."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, FRAMES, 24
    surface = skin()
    surface.materials.append(material("Skin", (0.55, 0.53, 0.48)))
    rigged = importlib.import_module("calmotion_extension.demo.rigged").rigged
    rig = rigged(BONES, Vector((0.0, 0.0, 0.0)), Vector((0.0, 0.0, LENGTH)), surface)
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


def material(name: str, color: tuple[float, float, float]) -> bpy.types.Material:
    """A matt paint."""
    paint = bpy.data.materials.new(name)
    paint.use_nodes = True
    paint.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1.0)
    return paint


def stage() -> None:
    """Floor, light and camera."""
    scene = bpy.context.scene
    floor = bpy.data.meshes.new("Floor")
    floor.from_pydata([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [], [(0, 1, 2, 3)])
    floor.materials.append(material("Floor", (0.5, 0.52, 0.55)))
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = 1.8, 0.2
    lamp, camera = bpy.data.objects.new("Sun", sun), bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    lamp.rotation_euler = (0.6, 0.3, 0.9)
    camera.location = (2.5, 0.5, 1.3)
    camera.rotation_euler = (Vector((0.0, 0.0, 0.9)) - camera.location).to_track_quat("-Z", "Y").to_euler()
    for obj in (bpy.data.objects.new("Floor", floor), lamp, camera):
        scene.collection.objects.link(obj)
    scene.camera, scene.world = camera, bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.55, 0.58, 0.62, 1.0)
    render = scene.render
    render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", SAMPLES, "CPU"
    scene.cycles.use_denoising = True
    scene.view_settings.view_transform = "Standard"
    render.resolution_x, render.resolution_y = SIZE
    render.use_stamp, render.use_stamp_note, render.stamp_font_size = True, True, 15
    for name in ("camera", "date", "frame", "render_time", "scene", "time", "filename", "lens", "memory", "hostname"):
        setattr(render, f"use_stamp_{name}", False)
    render.stamp_background = (0.0, 0.0, 0.0, 0.6)


def main() -> None:
    """Optimise, and render each frame."""
    folder, frames = Path(sys.argv[-2]), Path(sys.argv[-1])
    frames.mkdir(parents=True, exist_ok=True)
    extension(folder)
    character()
    scene = bpy.context.scene
    bpy.ops.wm.save_as_mainfile(filepath=str(frames / "arm.blend"))
    scene.calmotion.flexible, scene.calmotion.material, scene.calmotion.tolerance = "upper, hand", "nylon", 0.001
    assert bpy.ops.calmotion.optimize() == {"FINISHED"}, scene.calmotion.status
    stage()
    shown = importlib.import_module("calmotion_extension.errors")  # of the folder that was given
    for frame in range(scene.frame_start, scene.frame_end + 1, EVERY):
        scene.frame_set(frame)
        before, after = shown.errors_now(scene)
        errors = f"{before:.1f} mm (orange), optimised {after:.1f} mm (blue)"
        scene.render.stamp_note_text = f"frame {frame}: {errors}"
        scene.render.filepath = str(frames / f"{frame:03d}.png")
        bpy.ops.render.render(write_still=True)
    print(scene.calmotion.status)


main()
