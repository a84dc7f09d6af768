"""Run by Blender's Python: robots of rigid objects, with the folder of the extension and a folder for files.

Each is optimised twice, and where its objects are then goes to FOLDER/KIND/worlds.json for the test outside to compare.
"""

import importlib.util
import json
import math
import os
import sys
from pathlib import Path

import bpy

getattr(bpy.utils, "expose_bundled_modules", lambda: None)()
HAS_USD = importlib.util.find_spec("pxr") is not None  # not in bpy 4.2 from PyPI
FRAMES = range(1, 26)
PARTS = {  # size and centre
    "Base": ((0.3, 0.3, 0.1), (1.0, 0.5, 0.05)),
    "Table": ((0.2, 0.2, 0.1), (1.0, 0.5, 0.15)),
    "Upper Arm": ((0.06, 0.06, 0.5), (1.0, 0.5, 0.45)),
    "Fore.L": ((0.03, 0.03, 0.8), (1.0, 0.5, 1.1)),
    "Bracket": ((0.08, 0.02, 0.02), (1.0, 0.55, 0.8)),
    "Prop": ((0.1, 0.1, 0.1), (2.0, 0.0, 0.3)),
}


def box(name: str) -> bpy.types.Object:
    """A box whose scale is not applied, and whose mesh has another name."""
    size, center = PARTS[name]
    bpy.ops.mesh.primitive_cube_add(size=1, location=center)
    bpy.context.object.name, bpy.context.object.scale = name, size
    return bpy.context.object


def parent(child: bpy.types.Object, above: bpy.types.Object, bone: str = "") -> None:
    """Parent as Ctrl-P does, which keeps the child where it is."""
    bpy.ops.object.select_all(action="DESELECT")
    child.select_set(True)
    bpy.context.view_layer.objects.active = above
    if bone:
        above.data.bones.active = above.data.bones[bone]
    bpy.ops.object.parent_set(type="BONE" if bone else "OBJECT", keep_transform=True)


def key(target: bpy.types.Object | bpy.types.PoseBone, axis: int, angle: float, phase: float = 0.0) -> None:
    target.rotation_mode = "XYZ"
    for frame in FRAMES:
        target.rotation_euler[axis] = angle * math.sin(2.0 * math.pi * (frame - 1) / 24.0 + phase)
        target.keyframe_insert("rotation_euler", frame=frame)


def objects() -> bpy.types.Object:
    """Objects that are parented to each other, turned about pivots at their lower ends."""
    boxes = {name: box(name) for name in PARTS}
    for name in ("Upper Arm", "Fore.L"):
        size, center = PARTS[name]
        bpy.context.scene.cursor.location = (*center[:2], center[2] - size[2] / 2)
        bpy.ops.object.select_all(action="DESELECT")
        boxes[name].select_set(True)
        bpy.ops.object.origin_set(type="ORIGIN_CURSOR")
    for child, above in (("Table", "Base"), ("Upper Arm", "Table"), ("Fore.L", "Upper Arm"), ("Bracket", "Fore.L")):
        parent(boxes[child], boxes[above])
    key(boxes["Table"], 2, 0.8)
    key(boxes["Upper Arm"], 1, 0.4)
    key(boxes["Fore.L"], 1, -0.6, 0.5)
    return boxes["Table"]


def bones(ik: bool = False) -> bpy.types.Object:
    """Objects that are parented to bones, which a constraint may pose."""
    data = bpy.data.armatures.new("Rig")
    rig = bpy.data.objects.new("Rig", data)
    bpy.context.scene.collection.objects.link(rig)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    for name, low, high in (("root", 0, 0.1), ("yaw", 0.1, 0.2), ("upper", 0.2, 0.7), ("fore.L", 0.7, 1.5)):
        bone = data.edit_bones.new(name)
        bone.head, bone.tail = (1.0, 0.5, low), (1.0, 0.51 if ik and name == "upper" else 0.5, high)
        bone.parent = data.edit_bones[-2] if len(data.edit_bones) > 1 else None
    goal = data.edit_bones.new("goal")
    goal.head, goal.tail = (1.0, 0.5, 1.5), (1.0, 0.7, 1.5)
    bpy.ops.object.mode_set(mode="OBJECT")
    pose = rig.pose.bones
    for part, bone in zip(PARTS, ("root", "yaw", "upper", "fore.L", "fore.L"), strict=False):
        parent(box(part), rig, bone)
    key(pose["yaw"], 1, 0.8)
    if ik:
        bend = pose["fore.L"].constraints.new("IK")
        bend.target, bend.subtarget, bend.chain_count = rig, "goal", 2
        for name in ("upper", "fore.L"):
            pose[name].lock_ik_y = pose[name].lock_ik_z = True
        for frame in FRAMES:
            turn = 2.0 * math.pi * (frame - 1) / 24.0
            pose["goal"].location = (0.0, 0.3 + 0.1 * math.sin(turn), -0.3)
            pose["goal"].keyframe_insert("location", frame=frame)
    else:
        key(pose["upper"], 0, 0.4)
        key(pose["fore.L"], 0, -0.6, 0.5)
    return bpy.data.objects["Fore.L"]


def worlds() -> dict[str, list]:
    """World matrices of all objects at all frames."""
    found: dict[str, list] = {}
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        for obj in bpy.data.objects:
            found.setdefault(obj.name, []).append([list(row) for row in obj.matrix_world])
    return found


def actions() -> dict[str, str]:
    """The action of each object that has one."""
    shown = bpy.data.collections.get("Calmotion Errors")
    robots = [obj for obj in bpy.context.scene.objects if shown is None or obj.name not in shown.objects]
    return {
        obj.name: obj.animation_data.action.name for obj in robots if obj.animation_data and obj.animation_data.action
    }


def optimised(kind: str, folder: Path, selected: bpy.types.Object, changed: set[str]) -> None:
    """Optimise a robot twice, by one of its parts; the actions of some objects change."""
    folder.mkdir()
    scene, settings = bpy.context.scene, bpy.context.scene.calmotion
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = selected
    bpy.data.objects["Fore.L"].select_set(True)
    assert bpy.ops.calmotion.pick_selected() == {"FINISHED"} and settings.flexible == "Fore.L", settings.flexible
    settings.material, settings.tolerance = "nylon", 0.0005
    own, before = actions(), worlds()
    meant = {**own} | {name: f"{own.get(name, name)}_calm" for name in changed}
    results = []
    for _ in range(2):
        assert bpy.ops.calmotion.optimize() == {"FINISHED"}, settings.status
        assert actions() == meant, (kind, actions(), meant)
        assert set(own.values()) <= set(bpy.data.actions.keys())
        results.append((settings.status, sorted(action.name for action in bpy.data.actions), worlds()))
        assert results[-1][2].get("Prop") == before.get("Prop"), "what is not a part stays"
    assert results[0] == results[1], "a second run takes the place of the first"
    assert set(before) == {name for name in results[1][2] if name in before}
    (folder / "worlds.json").write_text(json.dumps({name: results[1][2][name] for name in before}))
    from calmotion_extension.keys import take_off

    take_off(scene.objects)
    off = max(abs(a - b) for name, after in worlds().items() if name in before
              for old, new in zip(before[name], after, strict=True)
              for row, other in zip(old, new, strict=True) for a, b in zip(row, other, strict=True))  # fmt: skip
    assert off < 1e-6 and actions() == own, (kind, off, "the animation is as it was")
    print(kind, settings.status)


def fresh() -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = FRAMES[0], FRAMES[-1], 24


def refused(selected: bpy.types.Object, words: str) -> None:
    """The button is disabled, or the run ends, with a message; nothing changes."""
    before = actions()
    bpy.context.view_layer.objects.active = selected
    try:
        result = bpy.ops.calmotion.optimize()
    except RuntimeError as error:
        assert words in str(error), error
    else:
        raise AssertionError(result)
    assert actions() == before and not any(name.endswith("_calm") for name in bpy.data.actions.keys())


def main() -> None:
    extension, folder = Path(sys.argv[-2]), Path(sys.argv[-1])
    sys.path.insert(0, str(folder))
    os.symlink(extension, folder / "calmotion_extension")
    import calmotion_extension

    calmotion_extension.register()
    fresh()
    box("Base")
    refused(box("Prop"), "Nothing selected is animated")
    key(bpy.data.objects["Prop"], 2, 0.5)
    refused(bpy.data.objects["Prop"], "parent objects to the selected one")
    if not HAS_USD:
        calmotion_extension.unregister()
        print("no USD")
        return
    fresh()
    table = objects()
    key(bpy.data.objects["Prop"], 2, 0.5)
    optimised("objects", folder / "objects", table, {"Table", "Upper Arm", "Fore.L"})
    fresh()
    optimised("bones", folder / "bones", bones(), {"Rig"})
    fresh()
    optimised("constraint", folder / "constraint", bones(ik=True), {"Table", "Upper Arm", "Fore.L", "Bracket"})
    fresh()
    table = objects()
    stays = bpy.data.objects["Fore.L"].constraints.new("LIMIT_ROTATION")
    stays.use_limit_y, stays.min_y, stays.max_y = True, -0.3, 0.3
    refused(table, "Clear Constraints")
    calmotion_extension.unregister()
    print("all is well")


if __name__ == "__main__":
    main()
