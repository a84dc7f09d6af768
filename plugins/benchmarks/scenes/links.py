"""Links of robots as bodies to be meshed, from any USD file with rigid bodies: no animation or motors are needed."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from calmotion import ShotError
from calmotion.mesh import AttachmentFrame
from calmotion.model import Body, ElasticMaterial, FlexibleSettings, Frame, MassProperties
from calmotion.usd import (
    Reading,
    is_rigid_body,
    joint_prims,
    mass_of,
    open_stage,
    prims_of,
    quiet,
    read_joint,
    shapes_of,
    tets_of,
    units_of,
)

# of polyamide as printed links are; relative errors of frequencies do not depend on its stiffness and density
POLYAMIDE = ElasticMaterial("", 1.8e9, 0.35, 1200.0)


@dataclass(frozen=True, eq=False)
class Link:
    """A link of a robot.

    Attributes:
        name: Of its prim.
        body: With surfaces or tetrahedra, and flexible settings.
        carrier: Where the joint towards the world takes hold of it, body frame; None without one.
        others: Where the other joints take hold of it, body frame.
        mass: What the robot states or its geometry and densities give; None where nothing does.
    """

    name: str
    body: Body
    carrier: Frame | None
    others: tuple[Frame, ...] = ()
    mass: MassProperties | None = None


def read_links(source: str) -> list[Link]:
    """The links that `FILE` or `FILE:PRIM` names; a prim by its path or its name, all rigid bodies without one.

    A material that is bound to the prim is not looked at: all links are of the same one.

    Raises:
        ShotError: The file cannot be read, or has no such prim.
    """
    file, wanted = _split(source)
    stage = open_stage(file)
    with quiet():
        reading = Reading(stage, units_of(stage), float(stage.GetStartTimeCode()))
        prims = [prim for prim in prims_of(stage) if is_rigid_body(prim)]
        if wanted:
            by_path = stage.GetPrimAtPath(wanted) if wanted.startswith("/") else None
            named = [prim for prim in [*prims, *prims_of(stage)] if prim.GetName() == wanted]
            prims = [by_path] if by_path else named[:1]
        if not prims:
            raise ShotError(
                "has no such link",
                path=file,
                found=wanted or "no prim with PhysicsRigidBodyAPI",
                remedy="Name a prim of the file, as in robot.usda:left_elbow_link",
            )
        carriers, others = _frames(reading, stage)
        links = []
        for prim in prims:
            pose = reading.pose(prim)
            shapes = shapes_of(reading, prim, pose)
            body = Body(
                path=str(prim.GetPath()),
                rest=pose.frame(reading.units.length(1.0)),
                mass=None,
                surfaces=tuple(shape.surface for shape in shapes),
                tets=tets_of(reading, prim, pose),
                flexible=FlexibleSettings(POLYAMIDE, mode_count=12),
            )
            joints = tuple(others.get(body.path, ()))
            mass = mass_of(reading, prim, pose, shapes)
            links.append(Link(prim.GetName(), body, carriers.get(body.path), joints, mass))
    return links


def links_of_all(sources: Iterable[str], say: Callable[[str], None]) -> Iterator[tuple[Link, str]]:
    """The links that each of some sources names, with the name of its file; of what cannot be read the reason is told.

    Args:
        sources: As of `read_links`.
        say: Takes the reasons.
    """
    for source in sources:
        try:
            links = read_links(source)
        except ShotError as error:
            say(str(error))
            continue
        yield from ((link, Path(_split(source)[0]).stem) for link in links)


def _split(source: str) -> tuple[str, str]:
    """File and prim; a drive letter is no prim."""
    file, colon, prim = source.rpartition(":")
    return (file, prim) if colon and len(file) > 1 else (source, "")


def _frames(reading: Reading, stage: Any) -> tuple[dict[str, Frame], dict[str, list[Frame]]]:
    """The frame of the first joint that has a body as its second one, and those of all its other joints."""
    poses = {str(prim.GetPath()): reading.pose(prim) for prim in prims_of(stage) if is_rigid_body(prim)}
    carriers: dict[str, Frame] = {}
    others: dict[str, list[Frame]] = {}
    for prim in joint_prims(stage):
        try:
            joint = read_joint(reading, prim, poses)
        except ShotError:
            continue  # what is wrong with a joint does not matter to the mesh of another link
        if joint is None:
            continue
        for body, frame, carries in ((joint.body1, joint.frame1, True), (joint.body0, joint.frame0, False)):
            if not body or not np.isfinite(frame.position).all():
                continue
            if carries and body not in carriers:
                carriers[body] = frame
            else:
                others.setdefault(body, []).append(frame)
    return carriers, others


def frames_of(link: Link) -> tuple[Frame, ...]:
    """The frames of its joints, that towards the world first."""
    return (*(() if link.carrier is None else (link.carrier,)), *link.others)


def attachments_of(link: Link) -> list[AttachmentFrame]:
    """The frames of a link's joints, that towards the world first, as the reduction has them."""
    return [AttachmentFrame(f"joint {k}", frame, "interface") for k, frame in enumerate(frames_of(link))]
