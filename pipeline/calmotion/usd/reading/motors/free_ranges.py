"""When a motor may be changed: `calm:motor:optimize`, which may be keyed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from calmotion.model import FreeTrack, Motor
from calmotion.usd import schemas
from calmotion.usd.clock import Clock

if TYPE_CHECKING:
    from pxr import Usd

_SCHEMA, _FREE = "CalmMotorAPI", "calm:motor:optimize"


def may_change(prim: Usd.Prim) -> bool:
    """Whether a motor may be changed at all."""
    samples = _free_samples(prim)
    return any(value for _, value in samples) if samples else bool(schemas.value(prim, _SCHEMA, _FREE))


def _free_samples(prim: Usd.Prim) -> list[tuple[float, bool]]:
    attribute = prim.GetAttribute(_FREE)
    if not attribute or not schemas.is_applied(prim, _SCHEMA):
        return []
    return [(code, bool(attribute.Get(code))) for code in attribute.GetTimeSamples()]


def free_tracks(stage: Usd.Stage, motors: Sequence[Motor], clock: Clock) -> tuple[FreeTrack, ...]:
    """When motors may be changed, of those for which the shot animates calm:motor:optimize: each sample holds until
    the next."""
    ranges = []
    for index, motor in enumerate(motors):
        samples = _free_samples(stage.GetPrimAtPath(motor.prim_path))
        if len({value for _, value in samples}) > 1:
            codes, values = zip(*samples, strict=True)
            ranges.append(FreeTrack(index, clock.seconds(np.array(codes, dtype=np.float64)), np.array(values, bool)))
    return tuple(ranges)
