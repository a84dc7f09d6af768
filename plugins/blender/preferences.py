# SPDX-License-Identifier: GPL-3.0-or-later
"""How Calmotion is started on this machine."""

from __future__ import annotations

import os
import shutil

import bpy

from .pipeline import words_of

COMMAND_VARIABLE = "CALMOTION_COMMAND"


class CalmotionPreferences(bpy.types.AddonPreferences):
    """Preferences of the extension."""

    bl_idname = __package__

    command: bpy.props.StringProperty(
        name="Command",
        description="Command that starts Calmotion, such as /opt/calmotion/bin/calmotion; empty: from the PATH",
    )
    keep_files: bpy.props.BoolProperty(
        name="Keep Files", description="Keep the exported shot and the layers beside the .blend file", default=True
    )

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the preferences."""
        self.layout.prop(self, "command")
        self.layout.prop(self, "keep_files")


def preferences_of(context: bpy.types.Context) -> CalmotionPreferences | None:
    """The preferences; None where the extension was registered by hand."""
    addon = context.preferences.addons.get(__package__)
    return addon.preferences if addon else None


def command_of(context: bpy.types.Context) -> list[str] | None:
    """The words that start calmotion: from the preferences, the environment, or the PATH; None without one."""
    preferences = preferences_of(context)
    words = words_of((preferences.command if preferences else "") or os.environ.get(COMMAND_VARIABLE, ""))
    if not words:
        command = shutil.which("calmotion")
        return [command] if command else None
    return words if shutil.which(words[0]) else None
