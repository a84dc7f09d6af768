"""Value clips of a layer: the files that they name, which USD opens while it composes a stage."""

import glob
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from pxr import Sdf, Tf

from calmotion.errors import ShotError
from calmotion.support.files import is_special
from calmotion.support.foreign_files import forbidden_place, refuse_lfs_pointers

MOST_CLIPS = 100_000  # of one template: USD looks for each of them
CLIPS, _VARIANT_SETS, _CHILDREN = "clips", "variantSetNames", "primChildren"  # metadata of a prim


def clip_assets(layer: Sdf.Layer) -> list[str]:
    """Asset paths of the clips and manifests that the prims of a layer name, and of the files that templates match.

    Raises:
        ShotError: A template asks for more clips than anybody has.
    """
    found: list[str] = []
    for prim in _with_clips(layer.pseudoRoot):
        sets = prim.GetInfo(CLIPS)
        for one in sets.values() if isinstance(sets, Mapping) else ():
            if isinstance(one, Mapping):
                found += _named(one)
                found += _matched(one, layer, str(prim.path))
    return [name for name in dict.fromkeys(found) if name]


def _with_clips(prim: Sdf.PrimSpec) -> Iterator[Sdf.PrimSpec]:
    """The prims below one that have clips, those in variants as well; of hundreds of thousands in a second."""
    waiting = list(prim.nameChildren.values())
    while waiting:
        one = waiting.pop()
        if one.HasInfo(CLIPS):
            yield one
        # asking for children and sets themselves takes several times as long as all else
        if one.HasInfo(_CHILDREN):
            waiting += one.nameChildren.values()
        if one.HasInfo(_VARIANT_SETS):
            for variants in one.variantSets.values():
                waiting += [variant.primSpec for variant in variants.variants.values()]


def _named(clips: Mapping[str, Any]) -> list[str]:
    assets = clips.get("assetPaths")
    listed = list(assets) if isinstance(assets, Iterable) else []
    return [asset.path for asset in (*listed, clips.get("manifestAssetPath")) if hasattr(asset, "path")]


def _matched(clips: Mapping[str, Any], layer: Sdf.Layer, path: str) -> list[str]:
    """The files in the place of a template, such as `./clip.###.usd`."""
    template = clips.get("templateAssetPath")
    if not isinstance(template, str) or not template:
        return []
    given = [clips.get(f"template{name}") for name in ("StartTime", "EndTime", "Stride")]
    numbers = [float(number) for number in given if isinstance(number, (int, float))]
    if len(numbers) == len(given):
        start, end, stride = numbers
        count = (end - start) / stride if stride > 0.0 else math.inf
        if not count <= MOST_CLIPS:
            raise ShotError(
                "its template of value clips asks for too many files",
                path=path,
                attribute=CLIPS,
                found=f"from {start:g} to {end:g} in steps of {stride:g}",
                remedy=f"Correct templateStartTime, templateEndTime and templateStride (at most {MOST_CLIPS:,} clips)",
            )
    pattern = re.sub("#+", "*", glob.escape(template))
    folder = os.path.dirname(layer.realPath)
    return [os.path.join(folder, name) for name in glob.glob(pattern, root_dir=folder or None)]


def refuse_place(path: str, named_by: str, attribute: str = "") -> None:
    """Refuse a file of the network, a device or a file of the system that a shot names.

    Args:
        path: As it is authored or resolved.
        named_by: The layer or prim that names it.
    """
    reason = forbidden_place(path)
    if reason is not None:
        raise ShotError(
            reason,
            path=named_by,
            attribute=attribute,
            found=f"@{path}@",
            remedy="Copy the file beside the shot, and name it by a relative path",
        )


def refuse_special(path: str, named_by: str = "") -> None:
    """Refuse a named pipe, a socket or a device in place of a layer: USD would wait for it for ever.

    Args:
        named_by: The layer that names it; empty for the shot itself.

    Raises:
        ShotError: It exists and is neither a file nor a folder.
    """
    if is_special(path):
        raise ShotError(
            "this is not a file but a named pipe, a socket or a device",
            path=named_by or path,
            found=path if named_by else None,
            remedy="Name a .usda, .usdc, .usd or .usdz file",
        )


def open_dependencies(root: Sdf.Layer) -> list[Sdf.Layer]:
    """The layers that a layer names, directly or not, opened before the stage so that none is a special file or a
    pointer of Git LFS."""
    opened, names = [root], {root.identifier}
    for layer in opened:
        for name in _named_by(layer):
            if name in names:
                continue
            names.add(name)
            refuse_place(name, layer.identifier)
            refuse_special(name, layer.identifier)
            refuse_lfs_pointers([name], path=layer.identifier)
            try:
                named = Sdf.Layer.FindOrOpen(name)
            except Tf.ErrorException:  # the composition reports it, with the prim
                named = None
            if named is not None:
                opened.append(named)
    return opened


def _named_by(layer: Sdf.Layer) -> list[str]:
    """Identifiers of what a layer names as sublayers, references, payloads and value clips.

    Raises:
        ShotError: A place of them is not opened.
    """
    assets = [asset for asset in (*layer.GetCompositionAssetDependencies(), *clip_assets(layer)) if asset]
    for asset in assets:
        refuse_place(asset, layer.identifier)
    named = (Sdf.ComputeAssetPathRelativeToLayer(layer, asset) for asset in assets)
    return list(dict.fromkeys(name for name in named if name))
