"""Which part carries which, where parts move: what the scene says, and what their motion says where that is no joint.

Parts that a program exports side by side, each with its motion in the world, are seated on the part, or on the world,
relative to which they have the fewest freedoms.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.rigging.part_joints import (
    BALL,
    FIXED,
    FREE,
    FREEDOMS,
    REVOLUTE,
    PartJoint,
    find_joint,
    relative,
    with_hinges,
)

WORLD = -1


@dataclass(frozen=True, eq=False)
class Seat:
    """What carries a part: index of the part, or `WORLD`, and the joint between them."""

    carrier: int
    joint: PartJoint


class PartMotions:
    """Motions of parts in the world, and the joints between pairs of them, each found once.

    Args:
        R: World rotations, shape [parts, n, 3, 3].
        p: World origins [m], shape [parts, n, 3].
        tolerance: Largest residual angle of a joint [rad].
        rounding: Of positions [m].
    """

    def __init__(self, R: Array, p: Array, tolerance: float, rounding: float) -> None:
        count = R.shape[1]
        # the last one, which is also at WORLD, is the world
        self.R = np.concatenate([R, np.broadcast_to(np.eye(3), (1, count, 3, 3))])
        self.p = np.concatenate([p, np.zeros((1, count, 3))])
        self.count, self.tolerance, self.rounding = len(R), tolerance, rounding
        self._found: dict[tuple[int, int], PartJoint] = {}

    def joint(self, part: int, carrier: int) -> PartJoint:
        """The joint of a part on a carrier."""
        if (part, carrier) not in self._found:
            motion = relative(self.R[carrier], self.p[carrier], self.R[part], self.p[part])
            self._found[part, carrier] = find_joint(*motion, self.tolerance, self.rounding)
        return self._found[part, carrier]

    def freedoms(self, part: int, carrier: int) -> int:
        """How many degrees of freedom that joint has."""
        return FREEDOMS[self.joint(part, carrier).kind]

    def hinged(self, part: int, seat: Seat) -> Seat:
        """A seat of which a ball joint has hinges."""
        if seat.joint.kind != BALL:
            return seat
        R, _ = relative(self.R[seat.carrier], self.p[seat.carrier], self.R[part], self.p[part])
        return Seat(seat.carrier, with_hinges(seat.joint, R, self.tolerance))


def seat_parts(motions: PartMotions, above: Sequence[int], sizes: Sequence[float]) -> list[Seat]:
    """The carrier of each part, without cycles.

    Args:
        above: The part that carries each in the scene, or `WORLD`, carriers first.
        sizes: Of the parts: of two that move as one the larger carries the other.

    Returns:
        Seats with at most one freedom on the part above where there is one, else those of the fewest freedoms; a part
        that fits nowhere is free on the part above it.
    """
    seats: dict[int, Seat] = {}

    def rank(offer: tuple[int, int]) -> tuple[float, ...]:
        part, carrier = offer
        own = carrier == above[part]
        return motions.freedoms(*offer), not own, _depth(seats, carrier), -sizes[part]

    while len(seats) < motions.count:
        waiting = [k for k in range(motions.count) if k not in seats]
        ready = [k for k in waiting if above[k] == WORLD or above[k] in seats]
        near = [k for k in ready if motions.freedoms(k, above[k]) <= (FREEDOMS[REVOLUTE] if above[k] != WORLD else 0)]
        for k in near:
            seats[k] = Seat(above[k], motions.joint(k, above[k]))
        if near:
            continue
        offers = [(k, j) for k in ready for j in dict.fromkeys((above[k], *seats))]
        k, j = min(offers, key=rank)
        if motions.joint(k, j).kind == FREE:
            k = max(ready, key=lambda part: (above[part] == WORLD, _partners(motions, above, part, waiting)))
            j = above[k]
        seats[k] = Seat(j, motions.joint(k, j))
    return [seats[k] for k in range(motions.count)]


def _depth(seats: dict[int, Seat], part: int) -> int:
    return 0 if part == WORLD else 1 + _depth(seats, seats[part].carrier)


def _partners(motions: PartMotions, above: Sequence[int], part: int, waiting: Sequence[int]) -> int:
    """How many other parts would be seated on one, if it were free in the world."""
    others = [k for k in waiting if k != part]
    return sum(above[k] == part or motions.freedoms(k, part) <= FREEDOMS[REVOLUTE] for k in others)


def closed_chains(motions: PartMotions, seats: Sequence[Seat]) -> list[tuple[int, int]]:
    """Pairs of parts that are not seated on each other, but stay together at a hinge, or as one: the tree has no joint
    there."""
    chains = [_chain(seats, k) for k in range(motions.count)]
    moving = [k for k in range(motions.count) if seats[k].joint.kind != FIXED]
    apart = [(j, k) for k in moving for j in moving if j < k and j not in chains[k] and k not in chains[j]]
    return [
        (j, k)
        for j, k in apart
        if (kind := motions.joint(k, j).kind) == FIXED or (kind == REVOLUTE and seats[j].carrier != seats[k].carrier)
    ]


def _chain(seats: Sequence[Seat], part: int) -> list[int]:
    chain = []
    while part != WORLD:
        chain.append(part)
        part = seats[part].carrier
    return chain
