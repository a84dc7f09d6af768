"""Calmotion's rules: functions from a stage to findings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from calmotion.errors import ShotError, each
from calmotion.model.outputs import ERROR, WARNING, Finding
from calmotion.usd.reading.shot import StageReading, read_stage
from calmotion.usd.reading.unread import misplaced_schemas, unread_attributes

if TYPE_CHECKING:
    from pxr import Usd

READABLE, SCHEMAS, PLACES, LIMITS = "ShotIsReadable", "SchemasAreKnown", "SchemasFit", "AnimationKeepsLimits"


def reading_findings(stage: Usd.Stage) -> Iterator[Finding]:
    """Errors and warnings of the reader, and motors that are animated beyond their limits."""
    try:
        read = read_stage(stage)
    except ShotError as error:
        yield from (finding_of(one, ERROR, READABLE) for one in each(error))
        return
    yield from (finding_of(one, WARNING, READABLE) for one in read.reading.warnings)
    yield from _beyond_limits(read)


def finding_of(error: ShotError, level: str, rule: str) -> Finding:
    """A problem as a finding."""
    found = "" if error.found is None else str(error.found)
    return Finding(level, rule, error.path, error.attribute, error.problem, found, error.remedy)


def _beyond_limits(read: StageReading) -> Iterator[Finding]:
    for motor, track in zip(read.character.motors, read.tracks, strict=True):
        joint = read.character.joints[motor.joint]
        unit = read.reading.units.meters if motor.linear else np.deg2rad(1.0)
        low, high = float(track.values.min()), float(track.values.max())
        for value, limit, beyond in ((low, joint.lower, low < joint.lower), (high, joint.upper, high > joint.upper)):
            if beyond and abs(value - limit) > 1e-6:
                yield Finding(
                    WARNING, LIMITS, motor.prim_path, motor.attribute,
                    "the animation goes beyond the limit of the joint",
                    f"{value / unit:.6g}, limit {limit / unit:.6g}", "Animate within the limit, or correct the limit",
                )  # fmt: skip


def unknown_attributes(stage: Usd.Stage) -> Iterator[Finding]:
    """Attributes in the namespace calm: that no applied schema declares."""
    return (finding_of(error, WARNING, SCHEMAS) for error in unread_attributes(stage, declared=True))


def wrong_prims(stage: Usd.Stage) -> Iterator[Finding]:
    """Calmotion's schemas on prims of the wrong kind, which USD does not check."""
    return (finding_of(error, WARNING, PLACES) for error in misplaced_schemas(stage))


Rule: TypeAlias = "Callable[[Usd.Stage], Iterable[Finding]]"

RULES: dict[str, tuple[Rule, str]] = {
    READABLE: (
        reading_findings,
        "The shot can be processed, and its motors can follow the animation within their limits.",
    ),
    SCHEMAS: (unknown_attributes, "Every attribute in the namespace calm: is one that is read."),
    PLACES: (wrong_prims, "Calmotion's schemas are applied to prims of the right kind."),
}
