# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders what the extension shows of an arm that waves: `make blender-pictures`.

Run by Blender's Python with the folder of the extension and a folder for the frames; CALMOTION_COMMAND starts
calmotion.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path

import arm  # beside this file
import bpy
from mathutils import Vector

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


def character() -> None:
    """The arm that waves, alone in the scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    arm.waving_arm()
    bpy.data.objects["Skin"].data.materials.append(material("Skin", (0.55, 0.53, 0.48)))


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
