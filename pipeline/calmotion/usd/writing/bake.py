"""The motion that is baked: the predicted one at the frames, or that of a rigid robot with the written curves."""

from dataclasses import dataclass

import numpy as np
from pxr import Sdf, Usd, UsdGeom, Vt

from calmotion.arrays import Array
from calmotion.model import Character, Motion, Skin
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd import gf
from calmotion.usd.clock import Clock
from calmotion.usd.transforms import Pose, pose_from_matrix
from calmotion.usd.writing.curves import attribute_spec


@dataclass(frozen=True, eq=False)
class BakedMotion:
    """Poses at the frames that were reached.

    Attributes:
        times: [s], shape [f].
        positions: [m], shape [f, B, 3].
        rotations: Unit quaternions, shape [f, B, 4].
        elastic: Elastic coordinates of each body, shape [f, r_b]; None for a rigid motion.
    """

    times: Array
    positions: Array
    rotations: Array
    elastic: tuple[Array, ...] | None


def simulated_motion(motion: Motion, times: Array) -> BakedMotion:
    """Pick steps of a simulation, such as its frames; a run that was interrupted gives those that it reached.

    Args:
        times: Of the steps to pick [s], shape [f].

    Raises:
        ValueError: A time is no step, which the time grid rules out for frames.
    """
    reached = times[times <= motion.times[-1] + 1e-9]
    step = float(motion.times[1] - motion.times[0])
    indices = np.round((reached - motion.times[0]) / step).astype(int)
    if len(reached) == 0 or np.max(np.abs(motion.times[indices] - reached)) > 1e-3 * step:
        raise ValueError("the frames of the shot are not steps of the simulation")
    return BakedMotion(
        reached,
        motion.positions[indices],
        motion.rotations[indices],
        tuple(u[indices] for u in motion.elastic),
    )


_EQUAL = 1e-6  # of matrices, over the size of their entries: what single precision leaves
_OP = "xformOp:transform:calmotion"  # a name of our own: never the type of an op that the shot has


def bake_bodies(
    layer: Sdf.Layer,
    stage: Usd.Stage,
    character: Character,
    motion: BakedMotion,
    clock: Clock,
    meters: float,
    changed: bool = False,
) -> None:
    """Author one matrix for each body and frame, relative to its parent prim, in place of its other transform ops.

    Args:
        layer: The Sdf.Layer to write to.
        stage: The shot, layers of ours muted.
        motion: What to bake.
        meters: Metres per unit of the stage.
        changed: Whether bodies that move, relative to their parent prim, as they are animated are left out.
    """
    codes = clock.time_codes(motion.times)
    poses = _rest_poses(stage, character, clock.start)
    worlds = {
        body.path: _world_matrices(poses[body.path], motion, k, meters)
        for k, body in enumerate(character.bodies)
        if not body.between
    }
    for body in character.bodies:
        if body.between:
            continue
        prim = stage.GetPrimAtPath(body.path)
        reset = UsdGeom.Xformable(prim).GetResetXformStack()
        local = worlds[body.path]
        if not reset:
            local = np.linalg.inv(_parent_matrices(stage, prim.GetParent(), worlds, poses, codes, clock.start)) @ local
        if changed and _same(local, prim, codes):
            continue
        spec = attribute_spec(layer, f"{body.path}.{_OP}", Sdf.ValueTypeNames.Matrix4d)
        for code, matrix in zip(codes, local, strict=True):
            layer.SetTimeSample(spec.path, float(code), gf.to_matrix(matrix))
        order = attribute_spec(layer, f"{body.path}.xformOpOrder", Sdf.ValueTypeNames.TokenArray, uniform=True)
        order.default = Vt.TokenArray(["!resetXformStack!", _OP] if reset else [_OP])


def bake_points(
    layer: Sdf.Layer,
    stage: Usd.Stage,
    character: Character,
    skins: tuple[Skin | None, ...],
    motion: BakedMotion,
    clock: Clock,
    meters: float,
) -> None:
    """Author the deformed points of the meshes of flexible bodies, and their extents.

    Args:
        skins: One for each body; None for a rigid one.
        The others as for `bake_bodies`; `motion` is a simulated one.
    """
    if motion.elastic is None:
        return
    codes = clock.time_codes(motion.times)
    xforms = UsdGeom.XformCache(Usd.TimeCode(clock.start))
    poses = _rest_poses(stage, character, clock.start)
    for body, skin, u in zip(character.bodies, skins, motion.elastic, strict=True):
        if skin is None:
            continue
        for surface, modes in zip(body.surfaces, skin.modes, strict=True):
            if surface.displaced == 0:
                continue
            prim = stage.GetPrimAtPath(surface.path)
            world = gf.matrix(xforms.GetLocalToWorldTransform(prim))
            to_body = meters * poses[body.path].rotation.T @ world[:3, :3]  # of vectors; stage units to m
            back = np.linalg.inv(to_body)
            rest = gf.points(prim.GetAttribute("points").Get(clock.start))
            own_modes = np.einsum("ab,nbr->nar", back, modes[: surface.displaced])
            points = attribute_spec(layer, f"{surface.path}.points", Sdf.ValueTypeNames.Point3fArray)
            extent = attribute_spec(layer, f"{surface.path}.extent", Sdf.ValueTypeNames.Float3Array)
            for code, coordinates in zip(codes, u, strict=True):
                moved = rest + own_modes @ coordinates
                layer.SetTimeSample(points.path, float(code), gf.to_points(moved))
                box = np.stack([moved.min(axis=0), moved.max(axis=0)])
                layer.SetTimeSample(extent.path, float(code), Vt.Vec3fArray.FromNumpy(box.astype(np.float32)))


def _rest_poses(stage: Usd.Stage, character: Character, start: float) -> dict[str, Pose]:
    """World poses of the bodies as authored at the first frame, stage units, with their scales."""
    xforms = UsdGeom.XformCache(Usd.TimeCode(start))
    return {
        body.path: pose_from_matrix(
            gf.matrix(xforms.GetLocalToWorldTransform(stage.GetPrimAtPath(body.path))), body.path
        )
        for body in character.bodies
        if not body.between
    }


def _world_matrices(rest: Pose, motion: BakedMotion, body: int, meters: float) -> Array:
    """Local-to-world matrices of a body in a motion, its scale kept, stage units, shape [f, 4, 4]."""
    out = np.zeros((len(motion.times), 4, 4))
    out[:, :3, :3] = rotation_from_quaternion(motion.rotations[:, body]) * rest.scale
    out[:, :3, 3] = motion.positions[:, body] / meters
    out[:, 3, 3] = 1.0
    return out


def _parent_matrices(
    stage: Usd.Stage, parent: Usd.Prim, worlds: dict[str, Array], poses: dict[str, Pose], codes: Array, start: float
) -> Array:
    """Local-to-world matrices of the prim above a body, shape [f, 4, 4], carried by the body above that, if any."""
    carrier = parent
    while carrier and str(carrier.GetPath()) not in worlds:
        if carrier.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(carrier).GetResetXformStack():
            carrier = None
            break
        carrier = carrier.GetParent()
    if not carrier:
        return np.array([_local_to_world(parent, code) for code in codes])
    at_start = gf.matrix(UsdGeom.XformCache(Usd.TimeCode(start)).GetLocalToWorldTransform(parent))
    path = str(carrier.GetPath())
    return worlds[path] @ np.linalg.inv(poses[path].matrix()) @ at_start


def _same(local: Array, prim: Usd.Prim, codes: Array) -> bool:
    """Whether local matrices, shape [f, 4, 4], are those that a prim is animated with."""
    xform = UsdGeom.Xformable(prim)
    authored = np.array([gf.matrix(xform.GetLocalTransformation(float(code))) for code in codes])
    return bool(np.max(np.abs(local - authored)) <= _EQUAL * max(1.0, float(np.max(np.abs(authored)))))


def _local_to_world(prim: Usd.Prim, code: float) -> Array:
    return gf.matrix(UsdGeom.XformCache(Usd.TimeCode(code)).GetLocalToWorldTransform(prim))
