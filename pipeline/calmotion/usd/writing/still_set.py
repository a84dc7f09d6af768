"""A set of many still prims around a shot, to measure how reading grows with it."""

from __future__ import annotations

from pathlib import Path

GROUP = 100  # prims of a group


def write_large_stage(shot: Path, prims: int, folder: Path) -> Path:
    """A root layer with a shot and a set of still meshes and cubes in groups, away from it.

    Args:
        shot: USD file.
        prims: Number of prims of the set, about.
        folder: Where it is written.
    """
    from pxr import Gf, Sdf

    layer = Sdf.Layer.CreateNew(str(folder / "set.usdc"))
    root = Sdf.CreatePrimInLayer(layer, "/Set")
    root.specifier, root.typeName = Sdf.SpecifierDef, "Xform"
    types, corners = Sdf.ValueTypeNames, [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    with Sdf.ChangeBlock():
        for g in range(max(1, prims // (GROUP + 1))):
            group = Sdf.PrimSpec(root, f"group{g}", Sdf.SpecifierDef, "Xform")
            for k in range(GROUP):
                prim = Sdf.PrimSpec(group, f"part{k}", Sdf.SpecifierDef, "Cube" if k % 2 else "Mesh")
                place = Sdf.AttributeSpec(prim, "xformOp:translate", types.Double3)
                place.default = Gf.Vec3d(2e3 + 2.0 * g, 2.0 * k, 0.0)
                order = Sdf.AttributeSpec(prim, "xformOpOrder", types.TokenArray, Sdf.VariabilityUniform)
                order.default = ["xformOp:translate"]
                Sdf.AttributeSpec(prim, "extent", types.Float3Array).default = [(-1, -1, -1), (1, 1, 1)]
                if not k % 2:
                    Sdf.AttributeSpec(prim, "points", types.Point3fArray).default = corners
                    Sdf.AttributeSpec(prim, "faceVertexCounts", types.IntArray).default = [3] * 4
                    faces = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]
                    Sdf.AttributeSpec(prim, "faceVertexIndices", types.IntArray).default = faces
    layer.Save()
    source = Sdf.Layer.FindOrOpen(str(shot))
    top = Sdf.Layer.CreateNew(str(folder / "large.usda"))
    top.subLayerPaths = [str(shot.resolve()), "./set.usdc"]
    for key in source.pseudoRoot.ListInfoKeys():
        if key not in ("subLayers", "subLayerOffsets", "customLayerData"):
            top.pseudoRoot.SetInfo(key, source.pseudoRoot.GetInfo(key))
    top.Save()
    return folder / "large.usda"
