"""The parts of a shot that move as rigid bodies: Xforms with keys, and where they are."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.usd import gf
from calmotion.usd.clock import Clock, clock_of
from calmotion.usd.reading.animated import carriers, codes_of, moving_prims
from calmotion.usd.reading.context import prims_below
from calmotion.usd.transforms import pose_from_matrix
from calmotion.usd.units import units_of

_STRETCH = 1e-4  # a part whose scale changes by more, relative to it, is no rigid body: rounding errors are a tenth


@dataclass(frozen=True, eq=False)
class Parts:
    """Prims that move relative to what carries them, those above first.

    Attributes:
        paths: Of the prims.
        above: Index of the part that carries each in the scene, -1 for the world.
        nested: Index of the part below which each is in the scene, -1 for none; another than `above` where a prim
            resets the transforms above it.
        rotations, positions: World poses at the time codes, the latter [m], shapes [parts, n, 3, 3] and [parts, n, 3].
        sizes: Of their boxes.
        codes: Time codes, shape [n].
        clock: Of the shot.
        problems: By part, why it is no rigid body.
    """

    paths: list[str]
    above: list[int]
    nested: list[int]
    rotations: Array
    positions: Array
    sizes: list[float]
    codes: Array
    clock: Clock
    problems: dict[int, ShotError]


def read_parts(stage: Usd.Stage) -> Parts | None:
    """The parts of a shot; None where no transform that carries geometry is animated.

    Raises:
        ShotError: The shot has no duration.
    """
    prims = moving_prims(stage)
    keys = {code for prim in prims for one in carriers(prim) for code in codes_of(one)}
    if not keys:
        return None
    clock = clock_of(stage, np.array(sorted(keys)))
    codes = clock.merged(np.array(sorted(keys)))
    index = {str(prim.GetPath()): k for k, prim in enumerate(prims)}

    def first_of(above: Iterable[Sdf.Path]) -> int:
        return next((index[str(path)] for path in above if str(path) in index), -1)

    matrices = np.zeros((len(prims), len(codes), 4, 4))
    for n, code in enumerate(codes):
        cache = UsdGeom.XformCache(float(code))
        for k, prim in enumerate(prims):
            matrices[k, n] = gf.matrix(cache.GetLocalToWorldTransform(prim))
    rotations, positions = np.zeros((*matrices.shape[:2], 3, 3)), np.zeros((*matrices.shape[:2], 3))
    problems = {}
    for k, prim in enumerate(prims):
        try:
            rotations[k], positions[k] = _rigid_motion(matrices[k], str(prim.GetPath()), codes)
        except ShotError as error:
            problems[k] = error
            rotations[k], positions[k] = np.eye(3), matrices[k, :, :3, 3]
    return Parts(
        list(index), [first_of(one.GetPath() for one in carriers(prim)[1:]) for prim in prims],
        [first_of(prim.GetPath().GetParentPath().GetAncestorsRange()) for prim in prims],
        rotations, units_of(stage).length(positions), [_size(prim, codes[0]) for prim in prims], codes, clock, problems,
    )  # fmt: skip


def own_geometry(prim: Usd.Prim, parts: Parts) -> bool:
    """Whether geometry is below a prim that belongs to no part below it."""
    return any(one.IsA(UsdGeom.Gprim) for one in prims_below(prim, lambda other: str(other.GetPath()) in parts.paths))


def _size(prim: Usd.Prim, code: float) -> float:
    box = UsdGeom.Imageable(prim).ComputeWorldBound(float(code), *UsdGeom.Imageable.GetOrderedPurposeTokens())
    return float(np.linalg.norm(gf.vector(box.ComputeAlignedRange().GetSize())))


def _rigid_motion(matrices: Array, path: str, codes: Array) -> tuple[Array, Array]:
    poses = [pose_from_matrix(matrix, path) for matrix in matrices]
    stretch = np.abs(np.array([pose.scale for pose in poses]) / poses[0].scale - 1.0).max(axis=1)
    worst = int(np.argmax(stretch))
    if stretch[worst] > _STRETCH:
        raise ShotError(
            "its scale is animated, and a part of a robot is rigid",
            path=path,
            attribute="xformOpOrder",
            found=f"a change by {stretch[worst]:.3g} at time code {codes[worst]:g}",
            remedy="Remove the animation of the scale of it and of the prims above it, or deactivate it in a layer "
            "over the shot",
        )
    return np.array([pose.rotation for pose in poses]), np.array([pose.position for pose in poses])
