"""Rigging: a file with a skinned character or animated parts becomes a layer with a robot."""

import os
from dataclasses import dataclass
from functools import partial

import numpy as np
from pxr import Usd

from calmotion.arrays import Array
from calmotion.catalogs.materials import MATERIALS
from calmotion.errors import ShotError
from calmotion.model import Animation, Character
from calmotion.model.outputs import Rig, RiggedJoint
from calmotion.rigging.links import Link, make_links, targets_of
from calmotion.rigging.part_joints import SINGLE
from calmotion.rigging.part_trees import PartMotions
from calmotion.usd import stages
from calmotion.usd.clock import Clock
from calmotion.usd.diagnostics import quiet
from calmotion.usd.layers import refuse_input_as_output, write_layer
from calmotion.usd.reading.context import is_rigid_body, prims_of
from calmotion.usd.reading.joints.joint_prims import joint_prims
from calmotion.usd.reading.provenance import provenance_of
from calmotion.usd.reading.shot import read_shot, shot_clock
from calmotion.usd.reading.skeletons import BoundSkeleton, bound_skeletons
from calmotion.usd.rigging.parts import Parts, read_parts
from calmotion.usd.rigging.posed_bodies import posed_bodies
from calmotion.usd.rigging.posed_robot import PosedRobot
from calmotion.usd.rigging.reproduction import largest_distance
from calmotion.usd.rigging.skinned_robot import SkinnedRobot
from calmotion.usd.rigging.skins import read_skin, skinned_meshes
from calmotion.usd.transforms import pose_from_matrix


@dataclass(frozen=True)
class RigOptions:
    """How a robot is made.

    Attributes:
        material: Name of the material of its links, one of `calmotion.catalogs.materials.MATERIALS`.
        angle_tolerance: Largest residual angle between a joint and its hinges [rad].
        servo_share: Mass of a servo between two hinges, over that of the link that they turn.
        flexible: Names of the flexible links, `all`, or empty.
    """

    material: str = "nylon"
    angle_tolerance: float = float(np.radians(0.05))
    servo_share: float = 0.05
    flexible: tuple[str, ...] = ()


def rig_shot(path: str, output: str, options: RigOptions | None = None) -> Rig:
    """Make a robot from a skinned character, or from rigid parts with animated transforms where nothing is skinned.

    The bodies stand as the skeleton does at the first frame. Each joint that turns gets the fewest hinges that follow
    it, each with a motor that names the joint of the skeleton, so that the animation stays where it is and results are
    written back to it. A root that moves is carried by its transform.

    Parts become bodies where they are, with the joints of the fewest freedoms that follow their motion, which is that
    of the motors.

    Args:
        path: File of the shot.
        output: Layer to write; it has the shot as its sublayer.

    Raises:
        ShotError: Nothing is animated, a part moves as no joint allows, the shot has physics already, a name is wrong,
            or nothing can be written.
    """
    options = options or RigOptions()
    if options.material not in MATERIALS:
        raise ShotError("there is no such material", found=options.material, remedy=f"Use {', '.join(MATERIALS)}")
    stage = stages.open_stage(path)
    refuse_input_as_output(output, [layer.realPath for layer in stage.GetUsedLayers(True) if layer.realPath])
    joints = joint_prims(stage)
    with quiet():
        skeletons = bound_skeletons(stage)
        skinned = any(len(one.codes()) and any(skinned_meshes(stage, one)) for one in skeletons)
        # bodies without joints are parts as others are
        physics = joints or [prim for prim in prims_of(stage) if skinned and is_rigid_body(prim)]
        if physics:
            raise ShotError(
                "the shot has physics already",
                path=physics[0].GetPath(),
                found=physics[0].GetTypeName() if joints else "PhysicsRigidBodyAPI",
                remedy="Run calmotion inspect on it. To have joints found from motion, name the file without a robot",
            )
        parts = None if skinned else read_parts(stage)
        rig = _rig_skinned if parts is None else partial(_rig_parts, parts)
        return rig(stage, path, output, options)


def _rig_skinned(stage: Usd.Stage, path: str, output: str, options: RigOptions) -> Rig:
    skeleton, clock = _animated_skeleton(stage, path)
    codes = clock.merged(skeleton.codes())
    links, moved = _links(stage, skeleton, codes, options.angle_tolerance)
    layer = SkinnedRobot(stage, skeleton, codes, links, MATERIALS[options.material], options.material)
    names = [link.name for link in links]
    flexible = _flexible(options, names)
    layer.author(options.servo_share, flexible, targets_of(links, skeleton.joints))
    written = layer.finish(provenance_of(path, stage, clock), output, "the skinned character")
    times, given, marks = clock.seconds(codes), layer.motions(), layer.marks(moved)
    off: list[float] = []
    write_layer(
        written,
        output,
        lambda temporary: off.append(largest_distance(*_validate(temporary, len(layer.motors)), times, given, marks)),
    )
    joints = tuple(
        RiggedJoint(
            skeleton.joints[link.joint], layer.body(k), tuple(layer.motors_of[k]), float(link.hinges.residual.max())
        )
        for k, link in enumerate(links)
        if link.parent >= 0
    )
    bending = tuple(layer.body(k) for k, name in enumerate(names) if name in flexible)
    return Rig(
        output, layer.robot, joints, layer.body_count, layer.mass, tuple(layer.targets), bending, off[0],
        layer.stretched(moved, given),
    )  # fmt: skip


def _rig_parts(parts: Parts, stage: Usd.Stage, path: str, output: str, options: RigOptions) -> Rig:
    rounding = SINGLE * float(np.abs(parts.positions).max())
    motions = PartMotions(parts.rotations, parts.positions, options.angle_tolerance, rounding)
    bodies, notes = posed_bodies(stage, parts, motions)
    layer = PosedRobot(stage, path, parts, motions, bodies, MATERIALS[options.material], options.material)
    names = [body.name for body in bodies]
    flexible = _flexible(options, names)
    layer.author(options.servo_share, flexible)
    written = layer.finish(provenance_of(path, stage, parts.clock), output, "the animated parts")
    times = parts.clock.seconds(parts.codes)
    given = {body.path: (parts.rotations[body.part], parts.positions[body.part]) for body in bodies if body.part >= 0}
    off: list[float] = []
    write_layer(
        written,
        output,
        lambda temporary: off.append(largest_distance(*_validate(temporary, len(layer.motors)), times, given)),
    )
    joints = tuple(
        RiggedJoint(body.path, body.path, tuple(layer.motors_of[k]), float(body.joint.tilt.max()))
        for k, body in enumerate(bodies)
        if body.joint is not None and layer.motors_of[k]
    )
    bending = tuple(body.path for body in bodies if body.name in flexible)
    return Rig(
        output, layer.robot, joints, layer.body_count, layer.mass, tuple(layer.targets), bending, off[0], tuple(notes)
    )


def _flexible(options: RigOptions, names: list[str]) -> list[str]:
    """Names of the links that bend."""
    flexible = names if options.flexible == ("all",) else list(options.flexible)
    unknown = [name for name in flexible if name not in names]
    if unknown:
        raise ShotError(
            "there is no such link",
            attribute="rig.skeleton.flexible",
            found=unknown[0],
            remedy=f"Use {', '.join(names)}, or all",
        )
    return flexible


def _animated_skeleton(stage: Usd.Stage, path: str) -> tuple[BoundSkeleton, Clock]:
    """The one skeleton that is animated, and the clock of the shot."""
    skeletons = bound_skeletons(stage)
    animated = [skeleton for skeleton in skeletons if len(skeleton.codes())]
    if not animated:
        place = str(skeletons[0].prim.GetPath()) if skeletons else path
        raise ShotError(
            "the skeleton is not animated"
            if skeletons
            else "the shot has neither a skeleton nor parts with animated transforms",
            path=place,
            attribute="skel:animationSource" if skeletons else "",
            remedy="Bind a SkelAnimation with time samples to it"
            if skeletons
            else "Name the file of a character with a UsdSkel Skeleton and a skinned mesh, or of meshes below "
            "Xforms with keys",
        )
    if len(animated) > 1:
        raise ShotError(
            "several skeletons are animated, but a robot is made from one",
            path=animated[1].prim.GetPath(),
            found=", ".join(str(skeleton.prim.GetPath()) for skeleton in animated),
            remedy="Deactivate the others in a layer over the shot",
        )
    return animated[0], shot_clock(stage, None)


def _links(stage: Usd.Stage, skeleton: BoundSkeleton, codes: Array, tolerance: float) -> tuple[list[Link], list[int]]:
    """The links, and the joints that move the skin."""
    skin = read_skin(stage, skeleton, float(codes[0]))
    if len(skin.triangles) == 0:
        raise ShotError(
            "no mesh is skinned to the skeleton, so its bodies have no geometry",
            path=skeleton.prim.GetPath(),
            remedy="Bind a Mesh to it with SkelBindingAPI, joint indices and weights",
        )
    place = str(skeleton.prim.GetPath())
    rotations = np.array(
        [[pose_from_matrix(m, place).rotation for m in skeleton.locals_at(float(code))] for code in codes]
    )
    turns = rotations @ np.swapaxes(rotations[0], 1, 2)
    parents = [skeleton.parent(k) for k in range(len(skeleton.joints))]
    links = make_links(skeleton.joints, parents, turns, (skin.points, skin.triangles), skin.weights, tolerance)
    if not any(link.piece for link in links):
        raise ShotError(
            "the skin encloses no volume, so its bodies have no mass",
            path=skin.meshes[0],
            attribute="points",
            remedy="Bind a closed mesh to the skeleton",
        )
    return links, np.flatnonzero(skin.weights.max(axis=0) > 0.0).tolist()


def _validate(temporary: str, motors: int) -> tuple[Character, Animation]:
    """Read what was written: it must load, with all of its motors."""
    character, animation, _ = read_shot(temporary)
    if len(character.motors) != motors:
        raise ShotError(
            "motors are missing from the written layer", path=os.path.basename(temporary), found=len(character.motors)
        )
    return character, animation
