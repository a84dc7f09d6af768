# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of a scene."""

from __future__ import annotations

import bpy

MATERIALS = (  # those of `calmotion rig`
    "abs",
    "asa",
    "pla",
    "petg",
    "nylon",
    "pa6",
    "onyx",
    "polycarbonate",
    "pom",
    "pmma",
    "polypropylene",
    "hdpe",
    "peek",
    "epoxy",
    "aluminium",
    "magnesium",
    "titanium",
    "steel",
    "stainless_steel",
    "brass",
    "carbon_fibre",
    "glass_fibre",
)


class CalmotionSettings(bpy.types.PropertyGroup):
    """Settings of a scene."""

    robot_layer: bpy.props.StringProperty(
        name="Robot",
        description="USD layer with the robot of the exported character; empty: make one of the skin or parts",
        subtype="FILE_PATH",
    )
    material: bpy.props.EnumProperty(
        name="Material",
        description="Material of the links of a robot that is made from the skin or of the parts",
        items=[(name, name.capitalize(), "") for name in MATERIALS],
    )
    flexible: bpy.props.StringProperty(
        name="Flexible",
        description="Bones or parts that bend, separated by commas, or all; the buttons below it pick them",
        default="all",
    )
    tolerance: bpy.props.FloatProperty(
        name="Tolerance (m)",
        description="Accuracy of the simulation at the targets in metres, whatever the units of the scene",
        default=0.001,
        min=1e-6,
        soft_max=0.1,
        precision=4,
    )
    show_errors: bpy.props.BoolProperty(
        name="Show Errors",
        description="Draw the ways of the targets as animated (orange) and optimised (blue), and key the errors",
        default=True,
    )
    status: bpy.props.StringProperty(name="Status", options={"SKIP_SAVE", "HIDDEN"})
    progress: bpy.props.FloatProperty(name="Progress", min=0.0, max=1.0, options={"SKIP_SAVE", "HIDDEN"})
