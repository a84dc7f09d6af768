"""Root layers over a shot that perform something else than it does: another length, and settings of the character."""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Character, Provenance
from calmotion.usd import schemas, stages
from calmotion.usd.layers import write_layer
from calmotion.usd.writing.metadata import author_stage_metadata
from calmotion.usd.writing.root import relative_asset

RETARGET = "CalmRetargetAPI"


def write_performance(
    output: str, provenance: Provenance, character: Character, motion: tuple[Array, Array] | None,
    settings: Mapping[str, str],
) -> str:  # fmt: skip
    """Write a layer that opens a shot with another motion and other settings of its character.

    Args:
        output: Layer to write.
        character: Of the shot; a motor that follows another one has no curve of its own.
        motion: Times [s] after the first frame, shape [f], and values of its motors [rad or m], shape [f, M], which are
            written to their drives; None keeps the shot's own.
        settings: Tokens of `CalmRetargetAPI` by the name of their attribute.

    Returns:
        The path of the layer.

    Raises:
        ShotError: It cannot be written, or does not compose.
    """
    from pxr import Sdf

    schemas.register()
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_stage_metadata(layer, provenance)
    layer.subLayerPaths = [relative_asset(provenance.shot, os.path.dirname(os.path.realpath(output)))]
    if motion is not None:
        codes = provenance.start_time_code + motion[0] * provenance.time_codes_per_second
        layer.endTimeCode = float(codes[-1])
        for motor, values in zip(character.motors, motion[1].T, strict=True):
            if motor.follows is not None:
                continue
            joint = Sdf.CreatePrimInLayer(layer, motor.prim_path)
            track = Sdf.AttributeSpec(joint, motor.attribute, Sdf.ValueTypeNames.Float)
            shown = values / provenance.meters_per_unit if motor.linear else np.degrees(values)
            for code, value in zip(codes, shown, strict=True):
                layer.SetTimeSample(track.path, float(code), float(value))
    if settings:
        prim = Sdf.CreatePrimInLayer(layer, character.path)
        applied = Sdf.TokenListOp()
        applied.prependedItems = [RETARGET]
        prim.SetInfo("apiSchemas", applied)
        for name, value in settings.items():
            attribute = Sdf.AttributeSpec(prim, name, Sdf.ValueTypeNames.Token, Sdf.VariabilityUniform)
            attribute.default = value

    def validate(temporary: str) -> None:
        stages.open_stage(temporary)

    write_layer(layer, output, validate)
    return output
