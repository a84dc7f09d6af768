"""Run by Blender's Python: what the page on Blender does by hand, with its menus' operators.

`by_hand.py EXTENSION FOLDER export` runs the page's script of an animated arm and exports it as FOLDER/character.usda;
`by_hand.py EXTENSION FOLDER import` imports FOLDER/calm_root.usda and prints the largest change of a bone.
"""

import runpy
import sys
from pathlib import Path

import bpy

EXTENSION, FOLDER, STEP = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
FRAMES = range(1, 49)


def poses(rig: bpy.types.Object) -> list[list[tuple[float, ...]]]:
    """The quaternion of each bone in its parent's axes, at each frame."""
    found = []
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        found.append(
            [
                tuple((bone.parent.matrix.inverted() @ bone.matrix).to_quaternion())
                for bone in rig.pose.bones
                if bone.parent
            ]
        )
    return found


def export() -> None:
    """File > Export > Universal Scene Description, with Animation and Armatures."""
    runpy.run_path(str(EXTENSION.parents[1] / "samples" / "blender" / "arm.py"), run_name="__main__")
    bpy.ops.wm.usd_export(filepath=str(FOLDER / "character.usda"), export_animation=True, export_armatures=True)


def bring_back() -> None:
    """File > Import > Universal Scene Description, of the result and of what was exported."""
    arms = []
    for name in ("character.usda", "calm_root.usda"):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.wm.usd_import(filepath=str(FOLDER / name))
        (rig,) = (obj for obj in bpy.data.objects if obj.type == "ARMATURE")
        arms.append(poses(rig))
    changes = [
        min(max(abs(x - sign * y) for x, y in zip(old, new, strict=True)) for sign in (1.0, -1.0))
        for before, after in zip(*arms, strict=True)
        for old, new in zip(before, after, strict=True)
    ]
    print("largest change:", max(changes))


export() if STEP == "export" else bring_back()
