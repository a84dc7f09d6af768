# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the sidebar of the 3D view."""

from __future__ import annotations

import bpy

from .errors import errors_now
from .preferences import command_of


class CALMOTION_PT_panel(bpy.types.Panel):
    """Settings, the button, and the progress."""

    bl_idname = "CALMOTION_PT_panel"
    bl_label = "Calmotion"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Calmotion"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the panel."""
        layout, settings = self.layout, context.scene.calmotion
        layout.use_property_split = True
        layout.prop(settings, "robot_layer")
        made = layout.column()
        made.active = not settings.robot_layer
        made.prop(settings, "material")
        made.prop(settings, "flexible")
        buttons = made.row(align=True)
        buttons.operator("calmotion.pick_bone", icon="BONE_DATA")
        buttons.operator("calmotion.pick_selected", icon="RESTRICT_SELECT_OFF")
        layout.prop(settings, "tolerance")
        layout.prop(settings, "show_errors")
        if command_of(context) is None:
            layout.label(text="The command calmotion was not found: see the preferences", icon="ERROR")
        layout.operator("calmotion.optimize", icon="ANIM_DATA")
        if bpy.ops.calmotion.cancel.poll():
            layout.progress(factor=settings.progress, text=settings.status)
            layout.operator("calmotion.cancel", icon="CANCEL")
        elif settings.status:
            layout.label(text=settings.status)
        errors = errors_now(context.scene)
        if errors is not None:
            box = layout.box()
            box.label(text=f"Error at frame {context.scene.frame_current}", icon="DRIVER_DISTANCE")
            box.label(text=f"as animated {errors[0]:.3g} mm", icon="COLORSET_02_VEC")
            box.label(text=f"optimised {errors[1]:.3g} mm", icon="COLORSET_04_VEC")
            box.operator("calmotion.worst_frame", icon="TIME")
