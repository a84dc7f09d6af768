"""Which animated parts of a shot become bodies of a robot, and the joints between them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from calmotion.errors import ShotError, raise_all
from calmotion.rigging.links import unique_name
from calmotion.rigging.part_joints import FIXED, FREE, REVOLUTE, PartJoint
from calmotion.rigging.part_trees import WORLD, PartMotions, Seat, closed_chains, seat_parts
from calmotion.usd.rigging.parts import Parts, own_geometry

_UNSURE = 1e-4  # [m] an axis that may be elsewhere by more is told


@dataclass(frozen=True, eq=False)
class PosedBody:
    """A part that is a body.

    Attributes:
        path: Of its prim.
        name: Unique among the bodies.
        carrier: Index of the body that carries it, -1 for the world.
        part: Its index among the parts; -1 for a prim that stands still and carries parts.
        on: Index of the part in whose axes the joint is, -1 for the world.
        joint: On the carrier; None for a prim that stands still.
    """

    path: str
    name: str
    carrier: int
    part: int
    on: int
    joint: PartJoint | None


def posed_bodies(stage: Usd.Stage, parts: Parts, motions: PartMotions) -> tuple[list[PosedBody], list[str]]:
    """The bodies of a robot, carriers first, and notes for the user.

    A part that does not move on its carrier belongs to it. A part without joint to anything, and without parts that it
    carries, is no part of the robot.

    Raises:
        ShotError: A part that moves as no joint allows, or is not rigid; no part that moves on another.
    """
    seats = [motions.hinged(k, seat) for k, seat in enumerate(seat_parts(motions, parts.above, parts.sizes))]
    # what resets its transforms below a part that moves, stands still beside it
    still = {
        k
        for k, seat in enumerate(seats)
        if seat.joint.kind == FIXED and seat.carrier == parts.above[k] == parts.nested[k]
    }
    moving = [k for k in range(len(seats)) if k not in still]
    on = {k: _resolved(seats, still, seats[k].carrier) for k in moving}
    bases = {k: _base(stage, parts, k) for k in moving if on[k] == WORLD and seats[k].joint.kind not in (FREE, FIXED)}
    free = [k for k in moving if on[k] == WORLD and seats[k].joint.kind != FIXED]
    alone = {k for k in free if not bases.get(k) and k not in on.values()}
    if len(alone) == len(moving):  # nothing but such parts: those with a joint to the world
        alone = {k for k in alone if seats[k].joint.kind == FREE}
    kept = [k for k in moving if k not in alone]
    notes = [f"{parts.paths[k]}: it moves by itself and carries nothing, so it is left out" for k in sorted(alone)]
    if not kept:
        raise ShotError(
            "no part moves on another one about a hinge, along a line or about a point, so there is no joint",
            path=parts.paths[0],
            found=f"{len(parts.paths)} animated transforms",
            remedy="Animate parts that are parented to each other, each about its pivot",
        )
    raise_all([parts.problems[k] for k in kept if k in parts.problems])
    notes += [f"{one.path}: {one.problem} ({one.found}), so it is left out" for one in parts.problems.values()]
    raise_all([_no_joint(parts, k, seats[k]) for k in kept if seats[k].joint.kind == FREE and on[k] != WORLD])
    bodies: list[PosedBody] = []
    names, index = set[str](), dict[str, int]()

    def add(k: int) -> int:
        path, joint, base = parts.paths[k], seats[k].joint, bases.get(k, "")
        if path not in index:
            carrier = add(on[k]) if on[k] != WORLD else WORLD
            if base and base not in index:
                index[base] = len(bodies)
                bodies.append(PosedBody(base, unique_name(base, names), WORLD, -1, WORLD, None))
            index[path] = len(bodies)
            carrier = index.get(base, carrier)
            bodies.append(PosedBody(path, unique_name(path, names), carrier, k, seats[k].carrier, joint))
        return index[path]

    for k in kept:
        add(k)
    notes += [note for body in bodies for note in _unsure(body, motions)]
    pairs = [pair for pair in closed_chains(motions, seats) if set(pair) <= set(kept)]
    if pairs:
        one, other = (parts.paths[k] for k in pairs[0])
        more = f", and {len(pairs) - 1} more pairs," if pairs[1:] else ""
        notes.append(
            f"{one} and {other}{more} stay together although none carries the other; where they are coupled, author "
            "the joint that closes this chain in a layer over the robot"
        )
    return bodies, notes


def _resolved(seats: Sequence[Seat], still: set[int], part: int) -> int:
    """The part of which another one is a part, or the world."""
    while part in still:
        part = seats[part].carrier
    return part


def _base(stage: Usd.Stage, parts: Parts, part: int) -> str:
    """The prim with geometry that stands still and carries a part; empty for the scene as a whole."""
    above = stage.GetPrimAtPath(parts.paths[part]).GetParent()
    if parts.nested[part] != parts.above[part]:
        return ""
    while above and not above.IsPseudoRoot() and not above.GetParent().IsPseudoRoot():
        if above != stage.GetDefaultPrim() and above.IsA(UsdGeom.Xformable) and own_geometry(above, parts):
            return str(above.GetPath())
        above = above.GetParent()
    return ""


def _no_joint(parts: Parts, k: int, seat: Seat) -> ShotError:
    tilt, gap = float(np.degrees(seat.joint.tilt.max())), 1e3 * float(seat.joint.gap.max())
    return ShotError(
        f"it moves on {parts.paths[seat.carrier]} neither about a hinge, nor along a line, nor about a point",
        path=parts.paths[k],
        attribute="xformOpOrder",
        found=f"{gap:.3g} mm and {tilt:.3f} deg off the nearest hinge or line",
        remedy="Rotate it about one pivot, or move it along one line, and give any other motion to an Xform between "
        "the two; or deactivate it in a layer over the shot",
    )


def _unsure(body: PosedBody, motions: PartMotions) -> list[str]:
    """A note on a hinge that turns too little to show where it is."""
    joint = body.joint
    if joint is None or joint.kind != REVOLUTE or (off := joint.uncertainty(motions.rounding)) <= _UNSURE:
        return []
    return [
        f"{body.path}: it turns by {np.degrees(np.ptp(joint.values)):.2g} deg only, so that its hinge may be "
        f"{1e3 * off:.2g} mm elsewhere; key a larger motion, or correct physics:localPos0 and localPos1 of its joint"
    ]
