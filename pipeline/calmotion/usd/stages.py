"""Opening a shot: composition errors become ShotErrors, and layers that Calmotion wrote are recognised."""

import hashlib
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pxr import Ar, Pcp, Sdf, Tf, Usd

from calmotion.errors import ShotError, raise_all
from calmotion.model import InputLayer
from calmotion.support.foreign_files import remedy_for
from calmotion.support.naming import nearest_name
from calmotion.usd import schemas
from calmotion.usd.dependencies import open_dependencies, refuse_special
from calmotion.usd.diagnostics import one_line, quiet

SUFFIXES = (".usda", ".usdc", ".usd", ".usdz")

METADATA_KEY = "calmotion"
# roles of the layers that Calmotion writes
CURVES, MOTION, ROOT, RIG, CALIBRATION = "curves", "motion", "root", "rig", "calibration"
RESULTS = (CURVES, MOTION, CALIBRATION)  # which a root layer opens with their shot

_ARCS = {"reference": "references", "payload": "payload", "sublayer": "subLayers", "variant": "variants"}
# Documents of MaterialX describe looks alone, and USD as it is installed by pip has no reader for them.
_LOOKS = (".mtlx", ".mtlx]")
_REFUSED = (
    "ErrorInvalidAssetPath",
    "ErrorInvalidSublayerPath",
    "ErrorUnresolvedPrimPath",
    "ErrorInvalidPrimPath",
    "ErrorSublayerCycle",
    "ErrorArcCycle",
    "ErrorVariableExpressionError",
)


@contextmanager
def refused_by_usd(stage: Usd.Stage) -> Iterator[None]:
    """Turn an error of USD into a ShotError with the prim and attribute that USD names."""
    try:
        yield
    except Tf.ErrorException as error:
        lines = [line for line in _text(error).splitlines() if line.strip()]
        text = lines[0].rpartition(" : ")[2].strip().strip("'") if lines else "an error without a message"
        site = re.search(r"<(/[^>.]*)\.?([^>]*)>", text)
        raise ShotError(
            "USD cannot evaluate the shot",
            path=site.group(1) if site else stage.GetRootLayer().identifier,
            attribute=site.group(2) if site else "",
            found=text,
            remedy="Correct the prim or attribute; usdview and `calmotion inspect --strict` give details",
        ) from error


def _nearest_file(path: str) -> str:
    """A sentence with the file or folder that is most like the first part of a path that does not exist, or empty."""
    parent = Path(path)
    while not parent.parent.is_dir() and parent != parent.parent:
        parent = parent.parent
    try:
        names = os.listdir(parent.parent)
        shots = [name for name in names if name.endswith(SUFFIXES) or (parent.parent / name).is_dir()]
        near = nearest_name(parent.name, shots) or nearest_name(parent.name, names)
    except OSError:
        return ""
    return f"Did you mean {parent.with_name(near)}? " if near and near != parent.name else ""


def _shots_in(folder: str) -> str:
    """What to name instead of a folder: the USD files in it, three at most."""
    try:
        shots = sorted(name for name in os.listdir(folder) if name.endswith(SUFFIXES))
    except OSError:
        shots = []
    if not shots:
        return "Name the .usda, .usdc, .usd or .usdz file of the shot"
    named = ", ".join(os.path.join(folder, name) for name in shots[:3])
    return f"Name the file of the shot: {named}" + (f", or another of {len(shots)}" if len(shots) > 3 else "")


def open_layer(path: str) -> Sdf.Layer:
    """The root layer of a shot.

    Raises:
        ShotError: The file does not exist, cannot be read, or is not a USD file.
    """
    if os.path.islink(path) and not os.path.exists(path):
        raise ShotError(
            "this is a symbolic link to a file that does not exist",
            path=path,
            found=os.readlink(path),
            remedy="Correct the link, or name the file itself",
        )
    if not os.path.exists(path):
        raise ShotError(
            "the file does not exist", path=path or "SHOT", remedy=f"{_nearest_file(path)}Check the path of the shot"
        )
    if os.path.isdir(path):
        raise ShotError("this is a folder", path=path, remedy=_shots_in(path))
    refuse_special(path)
    if not os.access(path, os.R_OK):
        raise ShotError("the file cannot be read", path=path, remedy="Check its permissions")
    reason = ""
    layer = None
    try:
        with quiet():
            layer = Sdf.Layer.FindOrOpen(str(path))
    except Tf.ErrorException as error:
        reason = one_line(_message(error))
    if layer is None:
        raise ShotError(
            "this is not a USD file, or it is damaged",
            path=path,
            found=reason or None,
            remedy=remedy_for(path, "usd") or "Name a .usda, .usdc, .usd or .usdz file that opens in a USD viewer",
        )
    return layer


def open_stage(path: str, *, muted: tuple[str, ...] = ()) -> Usd.Stage:
    """The composed stage of a shot, everything loaded and checked; registers Calmotion's schemas first.

    Args:
        path: File of the shot.
        muted: Identifiers of layers to leave out.

    Raises:
        ShotError: See `open_layer`; or a sublayer, reference or payload is missing.
    """
    schemas.register()
    layer = open_layer(path)
    with quiet():
        kept = open_dependencies(layer)
        try:
            stage = Usd.Stage.Open(layer, Usd.Stage.LoadAll)
        except Tf.ErrorException as error:
            raise ShotError(
                "USD cannot compose the shot",
                path=path,
                found=one_line(_message(error)) or None,
                remedy="Correct the file that it names; usdview shows where",
            ) from error
        del kept  # the stage has them now
        # USD keeps layers that were opened earlier in this process; take what is on disk now.
        for used in stage.GetUsedLayers():
            if not used.anonymous and not used.dirty:
                _reload(used)
        if muted:
            stage.MuteAndUnmuteLayers(list(muted), [])
        errors = stage.GetCompositionErrors()
    raise_all(_merged([refusal for error in errors if (refusal := _refusal(error, path))]))
    return stage


def _reload(layer: Sdf.Layer) -> None:
    """Take what is on disk now of a layer that may have been opened earlier in this process.

    Raises:
        ShotError: It is damaged now.
    """
    try:
        layer.Reload()
    except Tf.ErrorException as error:
        raise ShotError(
            "this is not a USD file any more, or it is damaged",
            path=layer.realPath,
            found=one_line(_message(error)) or None,
            remedy="Correct the file, or write it again",
        ) from error


def _merged(errors: list[ShotError]) -> list[ShotError]:
    """Merge the errors of prims that lack the same file."""
    groups: dict[tuple[str, ...], list[ShotError]] = {}
    for error in errors:
        groups.setdefault((error.problem, error.attribute, str(error.found), error.remedy), []).append(error)
    merged = []
    for (problem, attribute, _, remedy), group in groups.items():
        others = f", here and at {len(group) - 1} other prim{'s' * (len(group) > 2)}" if len(group) > 1 else ""
        paths = sorted(error.path for error in group)
        merged.append(
            ShotError(problem + others, path=paths[0], attribute=attribute, found=group[0].found, remedy=remedy)
        )
    return merged


def _text(error: object) -> str:
    """What an error of USD says; it may quote bytes of a file that are no UTF-8."""
    try:
        return str(error)
    except UnicodeDecodeError as undecodable:
        return undecodable.object.decode(errors="replace")


def _message(error: Exception) -> str:
    """What USD says, without where in its sources: the last of several errors, whose text may hold quotes itself."""
    messages = re.findall(r" at line \d+ in file \S+ : '(.*?)'\s*(?=\n\tError|$)", _text(error), re.DOTALL)
    return messages[-1].strip() if messages else ""


def _refusal(error: Pcp.ErrorBase, shot: str) -> ShotError | None:
    """The ShotError for a composition error that leaves out a part of the shot; None for any other."""
    if type(error).__name__ not in _REFUSED:
        return None
    text = one_line(_text(error))
    site = re.search(r"<(/[^>]*)>\.?\s*$", text)
    prim = site.group(1) if site else str(error.rootSite.path)
    assets = re.findall(r"@([^@]*)@", text)
    arc = next((name for name in _ARCS if name in text.lower()), "reference")
    file = assets[0] if assets else ""
    if arc != "sublayer" and file.lower().endswith(_LOOKS):
        return None
    if "Expression" in type(error).__name__:
        place = re.search(r" at (/[^ ]*) in @", text)
        return ShotError(
            f"an expression in its {arc} cannot be evaluated",
            path=place.group(1) if place else shot,
            attribute=_ARCS[arc],
            found=text,
            remedy="Define its variables in expressionVariables of the shot, or correct the expression",
        )
    if arc == "sublayer":
        return ShotError(
            "the layer names a sublayer that cannot be opened",
            path=assets[-1] if assets else shot,
            attribute=_ARCS[arc],
            found=f"@{assets[0]}@" if assets else text,
            remedy=_missing(file, arc),
        )
    if "UnresolvedPrimPath" in type(error).__name__:
        problem, remedy = f"its {arc} names a prim that does not exist", f"Correct the prim path of the {arc}"
        found: str = text
    elif "Cycle" in type(error).__name__:
        problem, remedy, found = "its composition refers to itself", "Remove the cycle", text
    else:
        problem = f"its {arc} cannot be opened"
        remedy = _missing(file, arc)
        found = f"@{assets[0]}@, introduced by {assets[1]}" if len(assets) > 1 else text
    return ShotError(problem, path=prim, attribute=_ARCS[arc], found=found, remedy=remedy)


def _missing(file: str, arc: str) -> str:
    """What to do with a file that USD cannot open."""
    if not os.path.isfile(file):
        return f"Put the file there, or correct or remove the {arc}"
    return remedy_for(file, "usd") or (
        f"The file is there, but USD cannot read it: convert it to .usd if it is of another kind, or remove the {arc}"
    )


def role_of(layer: Sdf.Layer) -> str:
    """The role of a layer that Calmotion wrote, such as `curves`; empty for any other layer."""
    origin = layer.customLayerData.get(METADATA_KEY)
    return str(origin.get("role", "")) if isinstance(origin, dict) else ""


def earlier_layers(stage: Usd.Stage, roles: tuple[str, ...] = (CURVES, MOTION)) -> tuple[str, ...]:
    """Identifiers of the layers in a stage with one of the given roles, the root layer excepted."""
    return tuple(
        layer.identifier
        for layer in stage.GetUsedLayers(True)
        if role_of(layer) in roles and layer != stage.GetRootLayer()
    )


def refuse_result_layer(stage: Usd.Stage, path: str) -> None:
    """Refuse a layer of results that was given instead of the root layer, which sublayers it and the shot."""
    if role_of(stage.GetRootLayer()) in RESULTS:
        raise ShotError(
            "this layer was written by Calmotion and holds only results, not the shot",
            path=path,
            remedy="Open the root layer beside it, whose name ends in _root, or the shot itself",
        )


def display_name(identifier: str, shot: str) -> str:
    """A layer's file relative to the folder of the shot."""
    return Path(os.path.relpath(os.path.realpath(identifier), os.path.dirname(os.path.realpath(shot)))).as_posix()


def input_layers(stage: Usd.Stage, shot: str) -> tuple[InputLayer, ...]:
    """Every file that a stage was composed from, the shot first, relative to the shot's folder, with SHA-256.

    Layers of earlier results are included unless they are muted.
    """
    files = [os.path.realpath(shot)]
    for layer in stage.GetUsedLayers(True):
        name, _ = Ar.SplitPackageRelativePathOuter(layer.realPath)  # a layer inside a .usdz counts as the package
        if name and not layer.anonymous and os.path.realpath(name) not in files:
            files.append(os.path.realpath(name))
    first, rest = files[0], sorted(files[1:])
    return tuple(InputLayer(display_name(file, shot), _sha256(file)) for file in (first, *rest))


def _sha256(file: str) -> str:
    with open(file, "rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()
