# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators: optimise, and cancel."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import bpy

from .bring_back import bring_back
from .character import character_of, export_character, exported_name, is_animated, links_of, parts_of
from .error_table import read_errors
from .errors import show_errors, worst_frame
from .keys import put_on, take_off
from .pipeline import PipelineRun, job_for
from .preferences import command_of, preferences_of

_RUNNING: dict[str, PipelineRun] = {}  # by the name of the scene; one for each


class CALMOTION_OT_optimize(bpy.types.Operator):
    """Optimise the animation so that the robot does not shake; the result is a new action"""

    bl_idname = "calmotion.optimize"
    bl_label = "Optimize Motion"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether an animated character is selected and no optimisation runs."""
        if context.scene.name in _RUNNING:
            cls.poll_message_set("Calmotion is running")
            return False
        character = character_of(context)
        if character is None or not is_animated(character):
            cls.poll_message_set("Nothing selected is animated: select an armature with an action, or an animated part")
            return False
        if len(parts_of(character)) == 1 and not context.scene.calmotion.robot_layer:
            cls.poll_message_set("A robot has several parts: parent objects to the selected one, or to its bones")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Run, and wait for the end."""
        run = self._begin(context)
        if run is None:
            return {"CANCELLED"}
        run.wait()
        return self._finish(context)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Run in the background, with progress; Escape cancels."""
        if self._begin(context) is None:
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Show the progress."""
        run, settings = self._run, context.scene.calmotion
        if event.type == "ESC" and event.value == "PRESS":
            run.cancel()
            settings.status = "cancelling"
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        settings.progress, settings.status = run.fraction, run.message
        for area in context.screen.areas if context.screen else ():
            area.tag_redraw()
        if run.running:
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        return self._finish(context)

    def _begin(self, context: bpy.types.Context) -> PipelineRun | None:
        """Export, and start the process; None where that cannot be done, which is reported."""
        command, settings = command_of(context), context.scene.calmotion
        if command is None:
            self.report({"ERROR"}, "The command calmotion was not found; set it in the preferences of the extension")
            return None
        character = character_of(context)
        assert character is not None  # poll
        self._character, self._folder = character.name, _folder(context)
        earlier = take_off(parts_of(character))  # the animation is what the animator made
        try:
            shot = export_character(context, character, self._folder / "shot.usda")
        finally:
            put_on(earlier)
            context.scene.frame_set(context.scene.frame_current)
        job = job_for(
            command, shot, self._folder, robot=bpy.path.abspath(settings.robot_layer) if settings.robot_layer else "",
            material=settings.material, flexible=",".join(map(exported_name, picked_bones(settings))),
            tolerance=settings.tolerance,
        )  # fmt: skip
        self._run = _RUNNING[context.scene.name] = PipelineRun(job).start()
        return self._run

    def _finish(self, context: bpy.types.Context) -> set[str]:
        """Import the result, or report what went wrong."""
        run, settings = _RUNNING.pop(context.scene.name), context.scene.calmotion
        settings.progress, settings.status = 0.0, run.outcome or ""
        try:
            if run.outcome == "cancelled":
                self.report({"WARNING"}, "Calmotion was cancelled; the animation is unchanged")
                return {"CANCELLED"}
            if run.outcome != "done":
                for error in run.errors:
                    self.report({"ERROR"}, error)
                return {"CANCELLED"}
            try:
                character = bpy.data.objects[self._character]
                changed = bring_back(context, character, self._folder / "shot.usda", run.job.root)
                if settings.show_errors:
                    _show(context, run.job.table)
            except (RuntimeError, OSError, ValueError) as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
            before, after = (1e3 * run.report[f"max_error_{when}_m"] for when in ("before", "after"))
            settings.status = f"{before:.3g} mm -> {after:.3g} mm"
            self.report({"INFO"}, f"{len(changed)} bones or objects changed; largest error {settings.status}")
            return {"FINISHED"}
        finally:
            preferences = preferences_of(context)
            if not (bpy.data.filepath and (preferences is None or preferences.keep_files)):
                shutil.rmtree(self._folder, ignore_errors=True)


def picked_bones(settings: bpy.types.PropertyGroup) -> list[str]:
    """The bones with flexible links; `all` for all."""
    return [name.strip() for name in settings.flexible.split(",") if name.strip()]


def _bones(self: bpy.types.Operator, context: bpy.types.Context) -> list[tuple[str, str, str]]:
    """The bones or parts to choose from; kept, since Blender does not keep the strings of a list."""
    character = character_of(context)
    links = links_of(character) if character is not None else ()
    _bones.kept = [("all", "All", "")] + [(link, link, "") for link in links]
    return _bones.kept


class CALMOTION_OT_pick_bone(bpy.types.Operator):
    """Make the link of a bone, or a part of a robot of rigid objects, flexible, or rigid again"""

    bl_idname = "calmotion.pick_bone"
    bl_label = "Pick Bone"
    bl_options = {"REGISTER", "UNDO"}
    bl_property = "bone"

    bone: bpy.props.EnumProperty(name="Bone", items=_bones)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether a character is selected."""
        return character_of(context) is not None

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Search in the list of bones."""
        context.window_manager.invoke_search_popup(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Add the bone, or remove it where it is there; `all` takes the place of all others."""
        settings = context.scene.calmotion
        names = [name for name in picked_bones(settings) if name != "all"]
        if self.bone == "all":
            names = ["all"]
        elif self.bone in names:
            names.remove(self.bone)
        else:
            names.append(self.bone)
        settings.flexible = ", ".join(names)
        return {"FINISHED"}


class CALMOTION_OT_pick_selected(bpy.types.Operator):
    """Make the links of the selected bones, or the selected parts, flexible, and all others rigid"""

    bl_idname = "calmotion.pick_selected"
    bl_label = "Selected Bones"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether links are selected."""
        return bool(_selected_links(context))

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Take their names."""
        context.scene.calmotion.flexible = ", ".join(_selected_links(context))
        return {"FINISHED"}


class CALMOTION_OT_worst_frame(bpy.types.Operator):
    """Go to the frame at which the robot would be farthest off without the optimisation"""

    bl_idname = "calmotion.worst_frame"
    bl_label = "Go to Largest Error"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether errors are shown."""
        return worst_frame(context.scene) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set the frame."""
        context.scene.frame_set(worst_frame(context.scene))
        return {"FINISHED"}


class CALMOTION_OT_cancel(bpy.types.Operator):
    """Stop the optimisation; the animation stays unchanged"""

    bl_idname = "calmotion.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Whether an optimisation runs."""
        return context.scene.name in _RUNNING

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Ask the process to stop."""
        _RUNNING[context.scene.name].cancel()
        return {"FINISHED"}


def _selected_links(context: bpy.types.Context) -> list[str]:
    character = character_of(context)
    selected = {one.name for one in (*(context.selected_pose_bones or ()), *context.selected_objects)}
    return [link for link in links_of(character) if link in selected] if character is not None else []


def _show(context: bpy.types.Context, table: Path) -> None:
    """Show the errors of a table, whose times begin with the first frame of the scene."""
    scene = context.scene
    frames = range(scene.frame_start, scene.frame_end + 1)
    rate = scene.render.fps / scene.render.fps_base
    show_errors(context, read_errors(table, [(frame - scene.frame_start) / rate for frame in frames]), frames)


def _folder(context: bpy.types.Context) -> Path:
    """The folder of the files: beside the .blend file, or a temporary one if it is not saved."""
    if bpy.data.filepath:
        blend = Path(bpy.data.filepath)
        folder = blend.parent / f"{blend.stem}_calmotion"
        folder.mkdir(exist_ok=True)
        return folder
    return Path(tempfile.mkdtemp(prefix="calmotion-"))
