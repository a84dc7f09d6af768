"""Atomic writing of USD layers."""

import os
from collections.abc import Callable, Iterable

from pxr import Sdf, Tf

from calmotion.errors import ShotError
from calmotion.support.files import replaced
from calmotion.usd.diagnostics import quiet
from calmotion.usd.stages import role_of

EXTENSIONS = (".usda", ".usdc", ".usd")


def refuse_input_as_output(output: str, inputs: Iterable[str]) -> None:
    """Refuse to write over a layer that was read.

    Raises:
        ShotError: `output` is one of `inputs`, also through links, or has a name that USD does not support.
    """
    if os.path.splitext(output)[1].lower() not in EXTENSIONS:
        raise ShotError(
            "the output is not named like a USD layer",
            path=output,
            remedy="Give it the extension .usda, .usdc or .usd",
        )
    if any(ord(letter) < 32 or ord(letter) == 127 for letter in output):
        raise ShotError(
            "the name of the output has a control character, which USD does not support",
            path=repr(output)[1:-1],
            remedy="Remove line ends and tabs from it",
        )
    if os.sep != "\\" and "\\" in os.path.abspath(output):
        raise ShotError(
            "the name or a folder of the output has a backslash, which USD takes for a slash",
            path=output,
            remedy="Write the layer into another folder, or rename it",
        )
    if os.path.isdir(output):
        raise ShotError("the output is a folder", path=output, remedy="Name a file")
    for name in inputs:
        same = os.path.realpath(output) == os.path.realpath(name)
        if same or (os.path.exists(output) and os.path.exists(name) and os.path.samefile(output, name)):
            raise ShotError(
                "the output is a layer of the shot, and input layers are never written to",
                path=output,
                remedy="Choose another output",
            )


def write_layer(layer: Sdf.Layer, output: str, validate: Callable[[str], object] | None = None) -> None:
    """Write an anonymous layer to a file, atomically.

    It is exported to a temporary file, opened again and compared before it replaces `output`, see `replaced`.

    Args:
        layer: The Sdf.Layer; its content is written in the format that the extension of `output` names.
        output: Destination.
        validate: Called with the path of the temporary file; raises a ShotError if the file is wrong otherwise.

    Raises:
        ShotError: The file cannot be written, or cannot be opened again.
    """
    try:
        with quiet(), replaced(output) as temporary:
            if not layer.Export(str(temporary)):
                raise OSError("USD could not write it")
            written = Sdf.Layer.OpenAsAnonymous(str(temporary))
            if written is None:
                raise OSError("what was written cannot be opened again")
            if lost := _lost(layer, written):
                raise OSError(f"{lost} is not what was written, when it is opened again")
            if validate is not None:
                validate(str(temporary))
    except (OSError, Tf.ErrorException) as error:
        raise ShotError(
            "the layer cannot be written",
            path=output,
            found=str(error).strip(),
            remedy="Check the folder, its permissions and the space on the disk",
        ) from error
    opened = Sdf.Layer.Find(output)
    if opened is not None:
        opened.Reload(True)


def _lost(layer: Sdf.Layer, written: Sdf.Layer) -> str:
    """What a written copy has otherwise: the rate, the role among the results, or the first attribute with
    another value, or number of samples or of knots; or empty."""
    if layer.timeCodesPerSecond != written.timeCodesPerSecond:
        return "timeCodesPerSecond"
    if role_of(layer) != role_of(written):
        return "customLayerData"
    paths: list[Sdf.Path] = []
    layer.Traverse("/", paths.append)
    for path in paths:
        made, found = layer.GetAttributeAtPath(path), written.GetAttributeAtPath(path)
        if made and (not found or _content(made) != _content(found)):
            return str(path)
    return ""


def _content(attribute: Sdf.AttributeSpec) -> tuple[object, int, int]:
    samples = attribute.layer.GetNumTimeSamplesForPath(attribute.path)
    return attribute.default, samples, len(attribute.GetSpline().GetKnots()) if attribute.HasSpline() else 0
