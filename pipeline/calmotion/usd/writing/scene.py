"""The tempo of a performance in USD: the map of times, and what else moves in the stage at the same tempo."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, Vt

from calmotion.arrays import Array
from calmotion.model.tempo import TimeMap
from calmotion.usd.clock import Clock
from calmotion.usd.reading.animated import MAP
from calmotion.usd.reading.context import prims_of
from calmotion.usd.writing.curves import attribute_spec

SAME = 1e-6  # time codes that are closer are one
_OPS = ("xformOp:", "xformOpOrder")


def author_map(layer: Sdf.Layer, character: str, tempo: TimeMap, clock: Clock) -> None:
    """Author the map of times on the character's root.

    Args:
        character: Path of the root.
    """
    spec = attribute_spec(layer, f"{character}.{MAP}", Sdf.ValueTypeNames.Double2Array, uniform=True)
    pairs = zip(clock.time_codes(tempo.animation), clock.time_codes(tempo.performance), strict=True)
    spec.default = Vt.Vec2dArray([Gf.Vec2d(float(made), float(shown)) for made, shown in pairs])


def author_scene(
    layer: Sdf.Layer, stage: Usd.Stage, tempo: TimeMap, clock: Clock, frame_times: Array, within: str
) -> None:
    """Author what moves in a stage at the tempo of a performance: cameras, props, roots, sounds.

    What USD interpolates has samples at the performance's frames and where the animation has them, what it holds only
    there. What the layer has already, and transforms of prims that it moves, are left.

    Args:
        stage: The shot, layers of ours muted.
        frame_times: Its frames [s].
        within: Path of the prim below which all is authored; `/` for the whole stage.
    """
    for attribute in _attributes(layer, stage, within):
        kind = attribute.GetTypeName()
        if not attribute.ValueMightBeTimeVarying():
            _author_time(layer, attribute, tempo, clock)
            continue
        own = np.array(attribute.GetTimeSamples(), dtype=np.float64)
        codes = clock.time_codes(tempo.performed(clock.seconds(own)))
        if _interpolates(kind):
            codes = _with_frames(codes, clock.time_codes(frame_times))
        spec = attribute_spec(layer, str(attribute.GetPath()), kind)
        for code in codes:
            value = attribute.Get(float(clock.time_codes(tempo.animated(clock.seconds(np.array([code]))))[0]))
            if value is not None:
                layer.SetTimeSample(spec.path, float(code), value)


def _with_frames(codes: Array, frames: Array) -> Array:
    """Time codes of samples, and of the frames between the first and last of them; all frames of a spline."""
    if not len(codes):
        return frames
    inside = frames[(frames > codes[0]) & (frames < codes[-1])]
    far = np.min(np.abs(inside[:, None] - codes), axis=1, initial=np.inf) > SAME
    return np.union1d(codes, inside[far])


def _attributes(layer: Sdf.Layer, stage: Usd.Stage, within: str) -> Iterator[Any]:
    """Attributes that follow the tempo."""
    root = Sdf.Path(within)
    for prim in prims_of(stage):
        if not prim.GetPath().HasPrefix(root) or prim.IsInstanceProxy():
            continue
        moved = layer.GetAttributeAtPath(prim.GetPath().AppendProperty("xformOpOrder")) is not None
        for attribute in prim.GetAuthoredAttributes():
            name = str(attribute.GetName())
            if (moved and name.startswith(_OPS)) or layer.GetAttributeAtPath(attribute.GetPath()):
                continue
            if attribute.ValueMightBeTimeVarying() or _is_time(attribute):
                yield attribute


def _is_time(attribute: Usd.Attribute) -> bool:
    return bool(attribute.GetTypeName() == Sdf.ValueTypeNames.TimeCode and attribute.HasAuthoredValue())


def _author_time(layer: Sdf.Layer, attribute: Usd.Attribute, tempo: TimeMap, clock: Clock) -> None:
    """Author a time of the animation, such as when a sound begins, as that of the performance."""
    found = float(attribute.Get())
    spec = attribute_spec(layer, str(attribute.GetPath()), attribute.GetTypeName(), uniform=True)
    moved = clock.time_codes(tempo.performed(clock.seconds(np.array([found]))))
    spec.default = Sdf.TimeCode(float(moved[0]))


def _interpolates(kind: Sdf.ValueTypeName) -> bool:
    """Whether USD interpolates values of a type."""
    names = Sdf.ValueTypeNames
    held = (
        names.Bool, names.UChar, names.Int, names.UInt, names.Int64, names.UInt64, names.String, names.Token,
        names.Asset, names.Int2, names.Int3, names.Int4, names.TimeCode,
    )  # fmt: skip
    return kind.scalarType not in held
