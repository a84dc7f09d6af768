"""Run by Blender's Python, with the folder of the extension, a folder for files, and the zip to install (or -)."""

import importlib.util
import math
import os
import runpy
import sys
from pathlib import Path

import bpy
from mathutils import Quaternion, Vector

getattr(bpy.utils, "expose_bundled_modules", lambda: None)()
HAS_USD = importlib.util.find_spec("pxr") is not None  # not in bpy 4.2 from PyPI; robots of objects need it
BONES, LENGTH, WIDTH = ("root", "upper", "hand"), 0.4, 0.015


def character(folder: Path, size: float = 1.0, names: tuple[str, str, str] = BONES) -> bpy.types.Object:
    """An arm of three bones with a skin; the two outer ones wave.

    Args:
        folder: For the file.
        size: Units of the scene in a metre: 100 in centimetres.
        names: Of the bones.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.unit_settings.scale_length = 1.0 / size
    scene.frame_start, scene.frame_end, scene.render.fps = 1, 25, 24
    arm = runpy.run_path(str(Path(__file__).parents[2] / "samples" / "blender" / "arm.py"))
    rig = arm["rigged"](names, Vector((0.0, 0.0, size)), Vector((size * LENGTH, 0.0, 0.0)), tube(size))
    for frame in range(1, 26):
        turn = 2.0 * math.pi * (frame - 1) / 24.0
        for name, angle in ((names[1], 0.5 * math.sin(turn)), (names[2], 0.6 * (1.0 - math.cos(turn)))):
            bone = rig.pose.bones[name]
            bone.rotation_mode = "XYZ" if name == names[2] else "QUATERNION"
            if name == names[2]:
                bone.rotation_euler = (angle, 0.0, 0.0)
                bone.keyframe_insert("rotation_euler", frame=frame)
            else:
                bone.rotation_quaternion = Quaternion((1, 0, 0), angle)
                bone.keyframe_insert("rotation_quaternion", frame=frame)
    rig.select_set(True)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "scene.blend"))
    return rig


def tube(size: float) -> bpy.types.Mesh:
    """A closed box along x, in slices; `size` units of the scene are a metre."""
    slices = 24
    xs = [len(BONES) * LENGTH * k / slices for k in range(slices + 1)]
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    points = [(size * x, size * y * WIDTH, size * (1 + z * WIDTH)) for x in xs for y, z in corners]
    sides = [(i, k, (k + 1) % 4) for i in range(slices) for k in range(4)]
    faces = [(4 * i + k, 4 * i + n, 4 * i + 4 + n, 4 * i + 4 + k) for i, k, n in sides]
    faces += [(3, 2, 1, 0), tuple(4 * slices + k for k in range(4))]
    mesh = bpy.data.meshes.new("Skin")
    mesh.from_pydata(points, [], faces)
    return mesh


def curves(action: bpy.types.Action) -> dict[str, list[float]]:
    """Values of the curves of an action, by their path and index."""
    if hasattr(action, "layers"):
        found = [
            c for layer in action.layers for strip in layer.strips for bag in strip.channelbags for c in bag.fcurves
        ]
    else:
        found = list(action.fcurves)
    return {f"{c.data_path}[{c.array_index}]": [point.co[1] for point in c.keyframe_points] for c in found}


def check_optimize(folder: Path) -> None:
    """The whole way there and back, through the operator."""
    rig = character(folder)
    old = rig.animation_data.action
    before, objects = curves(old), set(bpy.data.objects.keys())
    settings = bpy.context.scene.calmotion
    settings.flexible, settings.material, settings.tolerance = "upper, hand", "nylon", 0.0005
    assert bpy.ops.calmotion.optimize.poll()
    assert bpy.ops.calmotion.optimize() == {"FINISHED"}, settings.status
    new = rig.animation_data.action
    assert new is not old and new.name == "Wave_calm", new.name
    assert curves(old) == before, "the action of the animator is kept"
    after = curves(new)
    assert set(after) == set(before) and all(len(values) == 25 for values in after.values()), after.keys()
    changes = {p: max(abs(a - b) for a, b in zip(before[p], after[p], strict=True)) for p in before}
    moved = {path for path, change in changes.items() if change > 1e-4}
    assert moved and max(changes.values()) < 0.2, changes
    shown = set(bpy.data.collections["Calmotion Errors"].objects.keys())
    assert set(bpy.data.objects.keys()) - shown == objects and len(bpy.data.armatures) == 1, "what was imported is gone"
    assert (folder / "scene_calmotion" / "calm.usda").is_file()
    assert "->" in settings.status
    error_before, error_after = (float(part.split()[0]) for part in settings.status.split(" -> "))
    assert error_after < 0.2 * error_before, settings.status
    print("optimised:", settings.status, sorted(moved))
    assert bpy.ops.calmotion.optimize() == {"FINISHED"}, settings.status
    again = rig.animation_data.action
    assert again.name == "Wave_calm" and curves(again) == after and curves(old) == before, (
        "a second run is of the first's"
    )
    assert sorted(name for name in bpy.data.actions.keys() if "Wave" in name) == ["Wave", "Wave_calm"]
    check_errors(folder, error_before, error_after)


def check_errors(folder: Path, before: float, after: float) -> None:
    """What is shown of the errors is what the table says, at the frame that it is shown for."""
    import csv

    scene = bpy.context.scene
    with (folder / "scene_calmotion" / "errors.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    collection = bpy.data.collections["Calmotion Errors"]
    values = collection.objects["Calmotion Errors"]
    (name,) = {obj.name.removesuffix(" as animated now") for obj in collection.objects if obj.name.endswith("ed now")
               and "as animated" in obj.name}  # fmt: skip
    path = next(column.removesuffix(".error") for column in rows[0] if column.endswith(f"{name}.error"))
    worst = max(rows, key=lambda row: float(row[f"{path}.error_before"]))
    assert bpy.ops.calmotion.worst_frame() == {"FINISHED"}
    assert abs((scene.frame_current - scene.frame_start) / 24.0 - float(worst["time_s"])) < 0.6 / 24.0
    assert 0.8 * before < values["as_animated_mm"] <= 1.001 * before, (values["as_animated_mm"], before)
    assert values["optimised_mm"] <= 1.001 * after
    row = min(rows, key=lambda row: abs(float(row["time_s"]) - (scene.frame_current - scene.frame_start) / 24.0))
    for label, end in (("as animated", "_before"), ("optimised", "")):
        mark = collection.objects[f"{name} {label} now"].matrix_world.translation
        place = [float(row[f"{path}.{axis}{end}"]) for axis in "xyz"]
        assert max(abs(a - b) for a, b in zip(mark, place, strict=True)) < 0.01, (list(mark), place)
        trail = collection.objects[f"{name} {label}"].data.splines[0].points
        assert len(trail) == 25 and (trail[scene.frame_current - 1].co.xyz - mark).length < 1e-5
    blocks = [len(getattr(bpy.data, kind)) for kind in ("objects", "curves", "meshes", "actions", "collections")]
    from calmotion_extension.operators import _show

    _show(bpy.context, folder / "scene_calmotion" / "errors.csv")
    again = [len(getattr(bpy.data, kind)) for kind in ("objects", "curves", "meshes", "actions", "collections")]
    assert again == blocks, "a second run takes the place of the first"


def check_other_units_and_names(folder: Path) -> None:
    """Scenes in centimetres and feet, and bones with dots, give what the scene in metres gives."""
    found = {}
    names = {"dots": ("Bone", "Bone.001", "hand.L")}
    for kind, size in (("metres", 1.0), ("centimetres", 100.0), ("feet", 1.0 / 0.3048), ("dots", 1.0)):
        rig = character(folder, size, names.get(kind, BONES))
        settings, before = bpy.context.scene.calmotion, curves(rig.animation_data.action)
        settings.flexible, settings.tolerance = "", 0.0005
        for bone in names.get(kind, BONES)[1:]:
            assert bpy.ops.calmotion.pick_bone(bone=bone) == {"FINISHED"}
        assert bpy.ops.calmotion.optimize() == {"FINISHED"}, (kind, settings.status)
        after = curves(rig.animation_data.action)
        moved = max(abs(a - b) for path in before for a, b in zip(before[path], after[path], strict=True))
        found[kind] = (*(float(part.split()[0]) for part in settings.status.split(" -> ")), moved)
        print(kind, found[kind])
    *errors, moved = found["metres"]
    for kind, (*others, change) in found.items():
        assert all(abs(a - b) < 0.05 * b for a, b in zip(others, errors, strict=True)), (kind, found)
        # a search ends anywhere within its tolerance at the tip
        assert abs(change - moved) < 0.0005 / LENGTH, (kind, found)
    assert bpy.ops.calmotion.pick_bone(bone="hand.L") == {"FINISHED"} and settings.flexible == "Bone.001"
    assert bpy.ops.calmotion.pick_bone(bone="all") == {"FINISHED"} and settings.flexible == "all"


def export_again(folder: Path) -> None:
    """Export what was brought back, beside what was optimised, for the test outside to compare."""
    from calmotion_extension.character import export_character

    export_character(bpy.context, bpy.data.objects["Rig"], folder / "again.usda")
    for name in ("shot.usda", "robot.usda", "calm.usda", "calm_root.usda"):
        kept = name.replace("calm_root", "optimised_root")
        (folder.parent / kept).write_text((folder / "scene_calmotion" / name).read_text())


def check_wrong_bone(folder: Path) -> None:
    """A bone that is not there is told, and nothing changes."""
    rig = character(folder)
    bpy.context.scene.calmotion.flexible = "elbow"
    old = rig.animation_data.action
    try:
        result = bpy.ops.calmotion.optimize()
    except RuntimeError as error:  # Blender raises what an operator reports as an error
        assert "no such link" in str(error) and "upper" in str(error), error
    else:
        raise AssertionError(result)
    assert rig.animation_data.action is old
    assert bpy.ops.calmotion.optimize.poll(), "it can be run again"


ROBOT = """#usda 1.0
over "root"
{
    over "Base" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"]
    )
    {
        float physics:mass = 1

        over "Arm" (
            prepend apiSchemas = ["PhysicsRigidBodyAPI", "CalmFlexibleBodyAPI", "MaterialBindingAPI"]
        )
        {
            rel material:binding:physics = </root/Rubber>

            def Xform "tip" (
                prepend apiSchemas = ["CalmTargetAPI"]
            )
            {
                double3 xformOp:translate = (0.6, 0, 0)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }
        }
    }

    def Material "Rubber" (
        prepend apiSchemas = ["PhysicsVolumeDeformableMaterialAPI"]
    )
    {
        float physics:youngsModulus = 2e8
        float physics:poissonsRatio = 0.4
        float physics:density = 1100
    }

    def PhysicsFixedJoint "stand"
    {
        rel physics:body1 = </root/Base>
    }

    def PhysicsRevoluteJoint "hinge" (
        prepend apiSchemas = ["PhysicsDriveAPI:angular"]
    )
    {
        uniform token physics:axis = "Y"
        rel physics:body0 = </root/Base>
        rel physics:body1 = </root/Base/Arm>
    }
}
"""


def check_objects(folder: Path) -> None:
    """A character of objects that are parented to each other, with a robot of its own."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.render.fps = 1, 25, 24
    base = bpy.data.objects.new("Base", None)
    mesh = bpy.data.meshes.new("Arm")
    corners = [(x, y, z) for x in (0.0, 0.6) for y in (-0.01, 0.01) for z in (-0.01, 0.01)]
    mesh.from_pydata(corners, [], [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    arm = bpy.data.objects.new("Arm", mesh)
    arm.parent = base
    for obj in (base, arm):
        scene.collection.objects.link(obj)
    for frame in range(1, 26):
        arm.rotation_euler = (0.0, 0.6 * (1.0 - math.cos(2.0 * math.pi * (frame - 1) / 24.0)), 0.0)
        arm.keyframe_insert("rotation_euler", frame=frame)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "objects.blend"))
    bpy.context.view_layer.objects.active = arm
    arm.select_set(True)
    (folder / "robot_of_objects.usda").write_text(ROBOT)
    scene.calmotion.robot_layer = str(folder / "robot_of_objects.usda")
    old = arm.animation_data.action
    before = curves(old)
    assert bpy.ops.calmotion.optimize() == {"FINISHED"}, scene.calmotion.status
    new = arm.animation_data.action
    assert new is not old and curves(old) == before and base.animation_data is None
    bent = max(abs(a - b) for a, b in zip(before["rotation_euler[1]"], curves(new)["rotation_euler[1]"], strict=True))
    assert 1e-4 < bent < 0.3, bent
    error_before, error_after = (float(part.split()[0]) for part in scene.calmotion.status.split(" -> "))
    assert error_after < 0.2 * error_before, scene.calmotion.status
    shown = set(bpy.data.collections["Calmotion Errors"].objects.keys())
    assert {obj.name for obj in bpy.data.objects} - shown == {"Base", "Arm"}
    print("objects:", scene.calmotion.status)


def check_poll() -> None:
    """Without an armature there is nothing to do."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert not bpy.ops.calmotion.optimize.poll() and not bpy.ops.calmotion.cancel.poll()


def main() -> None:
    extension, folder, archive = Path(sys.argv[-3]), Path(sys.argv[-2]), sys.argv[-1]
    if archive == "-":
        sys.path.insert(0, str(folder))
        os.symlink(extension, folder / "calmotion_extension")
        import calmotion_extension

        calmotion_extension.register()
        (folder / "work").mkdir()
        check_poll()
        check_optimize(folder / "work")
        export_again(folder / "work")
        check_wrong_bone(folder / "work")
        (folder / "units").mkdir()
        check_other_units_and_names(folder / "units")
        if HAS_USD:
            check_objects(folder / "work")
        calmotion_extension.unregister()
        assert not hasattr(bpy.types.Scene, "calmotion") and not hasattr(bpy.types, "CALMOTION_OT_optimize")
        calmotion_extension.register()
        calmotion_extension.unregister()
    else:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
        names = [addon.module for addon in bpy.context.preferences.addons]
        assert any(name.endswith(".calmotion") for name in names), names
        assert hasattr(bpy.types.Scene, "calmotion")
    print("all is well")


if __name__ == "__main__":
    main()
