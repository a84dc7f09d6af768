# SPDX-License-Identifier: GPL-3.0-or-later
"""Calmotion as an extension of Blender: export, optimise in a separate process, import the animation."""

from __future__ import annotations

import bpy

from .operators import (
    CALMOTION_OT_cancel,
    CALMOTION_OT_optimize,
    CALMOTION_OT_pick_bone,
    CALMOTION_OT_pick_selected,
    CALMOTION_OT_worst_frame,
)
from .panel import CALMOTION_PT_panel
from .preferences import CalmotionPreferences
from .settings import CalmotionSettings

CLASSES = (
    CalmotionPreferences,
    CalmotionSettings,
    CALMOTION_OT_optimize,
    CALMOTION_OT_cancel,
    CALMOTION_OT_pick_bone,
    CALMOTION_OT_pick_selected,
    CALMOTION_OT_worst_frame,
    CALMOTION_PT_panel,
)


def register() -> None:
    """Add the classes, and the settings of a scene."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.calmotion = bpy.props.PointerProperty(type=CalmotionSettings)


def unregister() -> None:
    """Undo `register`."""
    del bpy.types.Scene.calmotion
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
