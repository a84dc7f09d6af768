# SPDX-License-Identifier: GPL-3.0-or-later
"""The errors over time in the viewport: trails and moving marks of the targets, and keyed values of the errors."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from .error_table import Place, TargetErrors, largest

COLLECTION = "Calmotion Errors"
BEFORE, AFTER = "as_animated_mm", "optimised_mm"  # properties of the empty that has the values
COLORS = {"as animated": (0.665, 0.112, 0.0, 1.0), "optimised": (0.0, 0.168, 0.445, 1.0)}  # Okabe and Ito's, linear
THICK = 0.003  # of the size of the trails: radius of a line
MARK = 7.0  # radius of a mark, over that of a line


def show_errors(context: bpy.types.Context, targets: Sequence[TargetErrors], frames: range) -> None:
    """Replace the shown errors by those of a run.

    Each target gets two trails, and two marks that move along them: orange as animated, blue optimised. An empty has
    the largest error of each frame as keyed properties [mm], which the panel and the Graph Editor show.

    Args:
        targets: Their places and errors at each frame.
        frames: Of the scene.
    """
    clear_errors()
    if not targets:
        return
    collection = bpy.data.collections.new(COLLECTION)
    context.scene.collection.children.link(collection)
    values = bpy.data.objects.new(COLLECTION, None)
    values.empty_display_size = 0.0
    collection.objects.link(values)
    for name, curve in zip((BEFORE, AFTER), largest(targets), strict=True):
        for frame, error in zip(frames, curve, strict=True):
            values[name] = 1e3 * error
            values.keyframe_insert(f'["{name}"]', frame=frame)
    metre = 1.0 / context.scene.unit_settings.scale_length  # in units of the scene
    places = [place for target in targets for run in (target.before, target.after) for place in run]
    size = max(max(axis) - min(axis) for axis in zip(*places, strict=True))
    radius = THICK * metre * max(size, 0.05)
    for target in targets:
        for label, run in (("as animated", target.before), ("optimised", target.after)):
            scaled = [tuple(metre * x for x in place) for place in run]
            _add_trail(collection, values, f"{target.name} {label}", label, scaled, radius)
            _add_mark(collection, values, f"{target.name} {label} now", label, scaled, frames, radius)


def clear_errors() -> None:
    """Remove what an earlier run shows."""
    collection = bpy.data.collections.get(COLLECTION)
    if collection is None:
        return
    left: list[tuple[str, str]] = []  # kinds and names: blocks themselves may go with their objects
    for obj in list(collection.objects):
        if obj.data is not None:
            left.append(("curves" if obj.type == "CURVE" else "meshes", obj.data.name))
        if obj.animation_data is not None and obj.animation_data.action is not None:
            left.append(("actions", obj.animation_data.action.name))
        bpy.data.objects.remove(obj, do_unlink=True)
    for kind, name in left:
        block = getattr(bpy.data, kind).get(name)
        if block is not None and block.users == 0:
            getattr(bpy.data, kind).remove(block)
    bpy.data.collections.remove(collection)


def errors_now(scene: bpy.types.Scene) -> tuple[float, float] | None:
    """The largest error of the current frame as animated and optimised [mm]; None where none are shown."""
    values = scene.objects.get(COLLECTION)
    return None if values is None or BEFORE not in values else (values[BEFORE], values[AFTER])


def worst_frame(scene: bpy.types.Scene) -> int | None:
    """The frame of the largest error as animated; None where none are shown."""
    values = scene.objects.get(COLLECTION)
    if values is None or values.animation_data is None or values.animation_data.action is None:
        return None
    for curve in _curves(values.animation_data.action):
        if curve.data_path == f'["{BEFORE}"]':
            frame, _ = max((point.co for point in curve.keyframe_points), key=lambda co: co[1])
            return round(frame)
    return None


def _curves(action: bpy.types.Action) -> list[bpy.types.FCurve]:
    if hasattr(action, "layers") and len(action.layers):
        bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
        return [curve for bag in bags for curve in bag.fcurves]
    return list(action.fcurves)


def _material(label: str) -> bpy.types.Material:
    name = f"Calmotion {label}"
    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        material.diffuse_color = COLORS[label]  # of the solid view
        material.use_nodes = True
        shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = COLORS[label]
        shader.inputs["Emission Color"].default_value = COLORS[label]
        shader.inputs["Emission Strength"].default_value = 0.6
    return material


def _add_trail(
    collection: bpy.types.Collection, parent: bpy.types.Object, name: str, label: str, places: Sequence[Place],
    radius: float,
) -> None:  # fmt: skip
    curve = bpy.data.curves.new(name, "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", radius
    line = curve.splines.new("POLY")
    line.points.add(len(places) - 1)
    for point, place in zip(line.points, places, strict=True):
        point.co = (*place, 1.0)
    curve.materials.append(_material(label))
    _add(collection, parent, bpy.data.objects.new(name, curve))


def _add_mark(
    collection: bpy.types.Collection, parent: bpy.types.Object, name: str, label: str, places: Sequence[Place],
    frames: range, radius: float,
) -> None:  # fmt: skip
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(*_octahedron(MARK * radius))
    mesh.materials.append(_material(label))
    mark = _add(collection, parent, bpy.data.objects.new(name, mesh))
    for frame, place in zip(frames, places, strict=True):
        mark.location = place
        mark.keyframe_insert("location", frame=frame)


def _add(collection: bpy.types.Collection, parent: bpy.types.Object, obj: bpy.types.Object) -> bpy.types.Object:
    obj.parent, obj.hide_select = parent, True
    collection.objects.link(obj)
    return obj


def _octahedron(radius: float) -> tuple[list[Place], list, list[tuple[int, int, int]]]:
    points = [tuple(sign * radius if k == axis else 0.0 for k in range(3)) for axis in range(3) for sign in (1, -1)]
    faces = [(x, y, z) for x in (0, 1) for y in (2, 3) for z in (4, 5)]
    turned = [face if (face[0] + face[1] + face[2]) % 2 == 0 else (face[0], face[2], face[1]) for face in faces]
    return points, [], turned
