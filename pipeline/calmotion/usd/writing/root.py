"""The small layer that opens a result with its shot."""

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pxr import Sdf

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Character, Provenance
from calmotion.usd import schemas, stages
from calmotion.usd.layers import refuse_input_as_output, write_layer
from calmotion.usd.writing.metadata import author_origin, author_stage_metadata


def root_path(layer: str) -> str:
    """Where the root layer of a layer goes: beside it, `<stem>_root.usda`."""
    return f"{os.path.splitext(layer)[0]}_root.usda"


def write_root(layer: str, provenance: Provenance, role: str) -> str:
    """Write the root layer that sublayers [the new layer, the shot].

    Where the shot is itself a root layer of an earlier result, what that one opened takes its place, without what
    the new layer replaces: a new motion replaces earlier motions, new curves replace both. A calibration replaces
    nothing: it lies on the shot that it began from.

    Args:
        layer: The layer of overs, already written.
        role: The role of that layer, `stages.CURVES`, `stages.MOTION` or `stages.CALIBRATION`.

    Returns:
        The path of the root layer.

    Raises:
        ShotError: It cannot be written, or does not compose.
    """
    output = root_path(layer)
    root = Sdf.Layer.CreateAnonymous(".usda")
    author_stage_metadata(root, provenance)
    author_origin(root, stages.ROOT, provenance)
    folder = os.path.dirname(os.path.realpath(output))
    replaced = {stages.MOTION: (stages.MOTION,), stages.CALIBRATION: ()}.get(role, (stages.CURVES, stages.MOTION))
    below = [relative_asset(path, folder) for path in shot_layers(provenance.shot, replaced)]
    root.subLayerPaths = [relative_asset(os.path.realpath(layer), folder), *below]
    root.documentation = f"Opens {os.path.basename(layer)} over its shot."
    write_layer(root, output, stages.open_stage)
    return output


def refuse_layers_of(shot: str, output: str) -> None:
    """Refuse an output, or its root layer, that is a layer of a shot.

    Raises:
        ShotError: It is, or the shot cannot be opened.
    """
    stage = stages.open_stage(shot)  # its layers live as long as it does
    inputs = [layer.realPath for layer in stage.GetUsedLayers() if layer.realPath]
    for name in (output, root_path(output)):
        refuse_input_as_output(name, inputs)


def refuse_foreign_root(layer: str) -> None:
    """Refuse a layer whose root layer would take the place of a file that Calmotion did not write.

    Args:
        layer: The layer of overs, not yet written.
    """
    path = root_path(layer)
    if not os.path.isfile(path):
        return
    try:
        role = stages.role_of(stages.open_layer(path))
    except ShotError:
        role = ""
    if role != stages.ROOT:
        raise ShotError(
            f"the root layer of {layer} would replace this file, which Calmotion did not write",
            path=path,
            remedy="Choose another -o, or move the file",
        )


def shot_layers(shot: str, replaced: tuple[str, ...]) -> list[str]:
    """The layers to put below a new result: the shot, or the layers of an earlier root layer but for `replaced`."""
    layer = stages.open_layer(shot)
    if stages.role_of(layer) != stages.ROOT:
        return [os.path.realpath(shot)]
    layers = []
    for asset in layer.subLayerPaths:
        path = layer.ComputeAbsolutePath(asset)
        if stages.role_of(stages.open_layer(path)) not in replaced:
            layers += shot_layers(path, replaced)
    return layers


def keeps_earlier_curves(provenance: Provenance) -> bool:
    """Whether curves of an earlier result stay below new ones, since no root layer that Calmotion wrote opens them."""
    if not provenance.earlier_layers:
        return False
    below = shot_layers(provenance.shot, (stages.CURVES, stages.MOTION))
    return any(stages.earlier_layers(stages.open_stage(path), (stages.CURVES,)) for path in below)


def relative_asset(path: str, folder: str) -> str:
    """An asset path relative to a folder, `./` in front; absolute where there is no relative one (another drive)."""
    try:
        relative = Path(os.path.relpath(os.path.realpath(path), folder)).as_posix()
    except ValueError:
        return Path(path).as_posix()
    return relative if relative.startswith("../") else f"./{relative}"


RETARGET = "CalmRetargetAPI"


def write_performance(
    output: str,
    provenance: Provenance,
    character: Character,
    motion: tuple[Array, Array] | None,
    settings: Mapping[str, str],
) -> str:
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
    write_layer(layer, output, stages.open_stage)
    return output
