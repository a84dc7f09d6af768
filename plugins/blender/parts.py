# SPDX-License-Identifier: GPL-3.0-or-later
"""Results of a robot of rigid parts: new actions of the objects, or of the bones that carry them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace

import bpy
from mathutils import Matrix

from .character import exported_name
from .keys import basis_of, discard, key_motion, take_off

EXACT = 1e-5  # largest difference of a world matrix from that of the result, over the size of the robot above 1

Motion = list[Matrix]  # at each frame


def put_on_parts(
    context: bpy.types.Context, parts: Sequence[bpy.types.Object], shot: Path, root: Path, frames: range
) -> list[str]:
    """Key objects so that they move as a result says: by the bones that carry them where that is exact.

    Args:
        parts: Of the character, parents first.
        shot: The exported character.
        root: Layer that opens the result with the shot.

    Returns:
        The names of the bones or objects that changed; none where the result moves no object by its transform.

    Raises:
        RuntimeError: Keys do not move the objects as the result says, or two of them have one name in USD.
    """
    old, new = (_worlds(layer, parts, frames) for layer in (shot, root))
    if old == new:
        return []
    size = max(abs(x) for motion in new.values() for world in motion for x in world.translation)
    exact, robot = EXACT * max(1.0, size), _Robot(context.scene, parts, frames, old, new)
    for by_bones in (True, False):
        changed = robot.key(by_bones, 0.1 * exact)
        part, frame, off = robot.farthest()
        if off < exact:
            return changed
        discard(take_off(parts))
    raise RuntimeError(
        f"{part} is {off:.3g} off the result at frame {frame}: constraints, drivers or delta transforms move it. Bake "
        "its action with Clear Constraints (Object > Animation > Bake Action), and run again"
    )


def _worlds(layer: Path, parts: Sequence[bpy.types.Object], frames: range) -> dict[str, Motion]:
    """World transforms in a layer of the parts that it has. Blender's importer would take shear and names away."""
    getattr(bpy.utils, "expose_bundled_modules", lambda: None)()  # of Blender as a module
    try:
        from pxr import Usd, UsdGeom
    except ImportError as error:  # bpy 4.2 from PyPI
        raise RuntimeError("this Blender has no USD for Python (pxr): use that of blender.org") from error
    paths = {part.name: _path(part) for part in parts}
    if len(set(paths.values())) < len(parts):
        raise RuntimeError(
            "two objects have the same name but for dots and spaces, which USD does not allow: rename one"
        )
    stage = Usd.Stage.Open(str(layer))
    stage.Reload()  # a run writes over the files of the one before it
    prims = {name: prim for name, path in paths.items() if (prim := stage.GetPrimAtPath(path))}
    if not prims:
        raise RuntimeError("the optimised layer contains no object of this character")
    caches = [UsdGeom.XformCache(frame) for frame in frames]
    return {
        name: [Matrix(cache.GetLocalToWorldTransform(prim)).transposed() for cache in caches]
        for name, prim in prims.items()
    }


def _path(part: bpy.types.Object) -> str:
    """Where Blender's exporter writes an object."""
    return f"{_path(part.parent) if part.parent else '/root'}/{exported_name(part.name)}"


class _Robot:
    """Parts as animated, and where they should be."""

    def __init__(
        self, scene: bpy.types.Scene, parts: Sequence[bpy.types.Object], frames: range, old: dict[str, Motion],
        new: dict[str, Motion],
    ) -> None:  # fmt: skip
        self._scene, self._parts, self._frames, self._new = scene, parts, frames, new
        self._moves = {name: [b @ a.inverted_safe() for a, b in zip(old[name], new[name], strict=True)] for name in new}
        self._still = [Matrix()] * len(frames)
        self._worlds: dict[str, Motion] = {part.name: [] for part in parts}
        self._bases: dict[str, Motion] = {part.name: [] for part in parts}
        self._poses: dict[tuple[str, str], Motion] = {}
        for number in frames:
            scene.frame_set(number)
            for part in parts:
                self._worlds[part.name].append(part.matrix_world.copy())
                self._bases[part.name].append(part.matrix_basis.copy())
                for bone in part.pose.bones if part.pose else ():
                    self._poses.setdefault((part.name, bone.name), []).append(bone.matrix.copy())

    def key(self, by_bones: bool, few: float) -> list[str]:
        """Key what changes; the names of that."""
        changed: list[str] = []
        carried: dict[tuple[str, str], Motion] = {}
        acted = {part.name for part in self._parts if part.animation_data and part.animation_data.action}
        for part in self._parts:
            if part.name in self._new:
                above = self._moves.get(part.parent.name, self._still) if part.parent else self._still
                if part.parent_type == "BONE":
                    above = carried.get((part.parent.name, part.parent_bone), above)
                basis = [
                    B @ W.inverted_safe() @ A.inverted_safe() @ N
                    for B, W, A, N in zip(
                        self._bases[part.name], self._worlds[part.name], above, self._new[part.name], strict=True
                    )
                ]
                changed += [part.name] if key_motion(part, self._bases[part.name], basis, self._frames, few) else []
            if by_bones and part.pose and part.name in acted:
                moves = self._moves_of_bones(part, acted)
                carried |= {(part.name, bone): motion for bone, motion in moves.items()}
                changed += self._key_bones(part, moves, few)
        return changed

    def farthest(self) -> tuple[str, int, float]:
        """Which part is farthest off the result, at which frame, and by how much in its world matrix."""
        found = []
        for k, number in enumerate(self._frames):
            self._scene.frame_set(number)
            for part in self._parts:
                if part.name in self._new:
                    rows = zip(part.matrix_world, self._new[part.name][k], strict=True)
                    off = max(abs(x - y) for row, other in rows for x, y in zip(row, other, strict=True))
                    found.append((part.name, number, off))
        return max(found, key=lambda one: one[2])

    def _moves_of_bones(self, rig: bpy.types.Object, acted: set[str]) -> dict[str, Motion]:
        """How the result moves each bone in the world: as a part on it without keys, else as the bone above it."""
        moves: dict[str, Motion] = {}
        on = {
            part.parent_bone: self._moves[part.name]
            for part in self._parts
            if part.parent == rig and part.parent_type == "BONE" and part.name in self._moves and part.name not in acted
        }
        for bone in rig.data.bones:  # those above first
            above = moves[bone.parent.name] if bone.parent else self._moves.get(rig.name, self._still)
            moves[bone.name] = on.get(bone.name, above)
        return moves

    def _key_bones(self, rig: bpy.types.Object, moves: dict[str, Motion], few: float) -> list[str]:
        old: dict[str, Motion] = {name: [] for name in moves}
        new: dict[str, Motion] = {name: [] for name in moves}
        for k, (world, lead) in enumerate(
            zip(self._worlds[rig.name], self._moves.get(rig.name, self._still), strict=True)
        ):
            poses = {name: self._poses[rig.name, name][k] for name in moves}
            back = (lead @ world).inverted_safe()
            before = {name: SimpleNamespace(matrix=pose) for name, pose in poses.items()}
            after = {name: SimpleNamespace(matrix=back @ moves[name][k] @ world @ pose) for name, pose in poses.items()}
            for name in moves:
                old[name].append(basis_of(rig, before, name))
                new[name].append(basis_of(rig, after, name))
        bones = [rig.pose.bones[name] for name in moves]
        return [bone.name for bone in bones if key_motion(bone, old[bone.name], new[bone.name], self._frames, few)]
