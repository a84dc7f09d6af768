"""The small arm of a soft plastic, whose shoulder moves from rest to rest: what is recorded in tests of calibration."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from pxr import Sdf
from small_shots import FORE, PLASTIC, RATE, SHOULDER, TARGET_POSITION, make_flexible, make_target, write_arm


def ease(s: float) -> float:
    """A quintic from 0 to 1 that is at rest at both ends."""
    s = float(np.clip(s, 0.0, 1.0))
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


def swung_plastic(
    path: Path, shoulder: Callable[[float], float], frames: int, modulus: float = 1e8, damping: float = 0.015
) -> Path:
    """Write the shot.

    Args:
        path: The file.
        shoulder: Angle of the shoulder [deg] at a time [s]; the elbow stays at 10 degrees.
        frames: Last frame.
        modulus: Young's modulus [Pa].
        damping: Damping ratio.
    """

    def edit(stage):
        make_flexible(stage, FORE, youngsModulus=modulus)
        make_target(stage)
        material = stage.GetPrimAtPath(PLASTIC)
        material.AddAppliedSchema("CalmDampingAPI")
        material.CreateAttribute("calm:damping:ratio", Sdf.ValueTypeNames.Float).Set(damping)
        for joint in (SHOULDER, "/Arm/joints/elbow"):
            attribute = stage.GetPrimAtPath(joint).GetAttribute(TARGET_POSITION)
            attribute.Clear()
            for frame in range(frames + 1):
                attribute.Set(shoulder(frame / RATE) if joint == SHOULDER else 10.0, frame)
        stage.SetEndTimeCode(frames)

    return write_arm(path, edit)
