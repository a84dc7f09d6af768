"""The files that a shot names, refused before they are opened where they are no files or lie where none are opened."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calmotion.errors import ShotError
from calmotion.support.files import is_special
from calmotion.support.foreign_files import forbidden_place, refuse_lfs_pointers
from calmotion.usd.clips import clip_assets

if TYPE_CHECKING:
    from pxr import Sdf


def refuse_place(path: str, named_by: str, attribute: str = "") -> None:
    """Refuse a file of the network, a device or a file of the system that a shot names.

    Args:
        path: As it is authored or resolved.
        named_by: The layer or prim that names it.

    Raises:
        ShotError: It is one.
    """
    reason = forbidden_place(path)
    if reason is not None:
        raise ShotError(
            reason, path=named_by, attribute=attribute, found=f"@{path}@",
            remedy="Copy the file beside the shot, and name it by a relative path",
        )  # fmt: skip


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
    from pxr import Sdf, Tf

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
    from pxr import Sdf

    assets = [asset for asset in (*layer.GetCompositionAssetDependencies(), *clip_assets(layer)) if asset]
    for asset in assets:
        refuse_place(asset, layer.identifier)
    named = (Sdf.ComputeAssetPathRelativeToLayer(layer, asset) for asset in assets)
    return list(dict.fromkeys(name for name in named if name))
