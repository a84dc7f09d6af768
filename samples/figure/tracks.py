"""Keyed curves of the figure as tracks of its motors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from kit.curves import Key, sample_keys

from .model import SIDES

Keys = Mapping[str, Sequence[Key]]


def tracks(trunk: Keys, left: Keys, right: Keys, frames: Sequence[int]) -> dict[str, tuple[float, ...]]:
    """Angle of each motor [deg] at the frames; the arms' keys take a yaw as positive inwards."""
    curves = {name: sample_keys(keys, frames) for name, keys in trunk.items()}
    for (side, sign), arm in zip(SIDES.items(), (left, right), strict=True):
        for motor, keys in arm.items():
            curves[f"{side}{motor}"] = (-sign if motor == "ShoulderYaw" else 1.0) * sample_keys(keys, frames)
    # Adding 0 turns a negative zero into zero.
    return {name: tuple((np.round(values, 4) + 0.0).tolist()) for name, values in curves.items()}
