"""The tolerance and the goal of a shot, and the error budget of a result."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.model.character import WORLD, Character, Joint

SHARE_OF_REACH = 1e-3
SMALLEST = 1e-6  # of a character without extent [m]


def tolerance_of(character: Character, requested: float | None = None) -> float:
    """Accuracy of the simulation at the targets [m]: as requested, or of the shot, or a thousandth of the reach."""
    return requested or character.retarget.tolerance or max(SHARE_OF_REACH * reach(character), SMALLEST)


def goal_of(character: Character, requested: float | None = None) -> float | None:
    """Error that is accepted at the targets after optimising [m]: as requested, or of the shot; None: none is named."""
    return requested or character.retarget.goal


def reach(character: Character) -> float:
    """Length of the longest chain from the base to a target: from joint to joint, and the travel of its sliders [m].

    Joints that close chains do not count. A robot that floats reaches from its feet. Without targets it is the distance
    to the farthest joint.
    """
    nodes, far = _distances(character)
    ends = [
        nodes[target.body][0] + _length(target.frame.position - nodes[target.body][1])
        for target in character.targets
        if target.body in nodes
    ]
    return max(ends, default=far)


def _distances(character: Character) -> tuple[dict[int, tuple[float, Array]], float]:
    """For each body, the distance from the base to the joint that carries it and that joint's place in the body."""
    ends: dict[int, list[tuple[Joint, int]]] = {}
    floats = any(joint.kind == "floating" for joint in character.joints)
    for joint in character.joints:
        if joint.contact is not None:
            counts = floats
        else:
            counts = not (joint.kind == "floating" or joint.closes_chain or joint.redundant)
        if counts:
            ends.setdefault(joint.body0, []).append((joint, 0))
            ends.setdefault(joint.body1, []).append((joint, 1))
    nodes: dict[int, tuple[float, Array]] = {}
    far = 0.0
    # bodies that nothing joins to the world float: the first of each such group is its base
    for base in (WORLD, *range(len(character.bodies))):
        if base in nodes:
            continue
        nodes[base] = (0.0, np.zeros(3))
        waiting = [base]
        while waiting:
            body = waiting.pop(0)
            distance, entered = nodes[body]
            for joint, side in ends.get(body, []):
                places = (joint.frame0.position, joint.frame1.position)
                other = (joint.body1, joint.body0)[side]
                if other in nodes:
                    continue
                # the world's joints are the base, wherever they are
                step = 0.0 if body == WORLD else _length(places[side] - entered)
                nodes[other] = (distance + step + _travel(joint), places[1 - side])
                far = max(far, nodes[other][0])
                waiting.append(other)
    return nodes, far


def _travel(joint: Joint) -> float:
    travel = joint.upper - joint.lower
    return travel if joint.kind == "prismatic" and np.isfinite(travel) else 0.0


def _length(vector: Array) -> float:
    return float(np.linalg.norm(vector))


MESH, REDUCTION, SUBSPACE = "mesh", "reduction", "POD subspace"
CHOICES, STEP, SEARCH = "model", "time step", "search"
MEASURED = "measured error"  # stands for all others where a result was verified
SEARCH_SHARE = 0.1  # of the tolerance: a search does not pursue a smaller gain


@dataclass(frozen=True)
class BudgetEntry:
    """One approximation.

    Attributes:
        source: One of the constants of this module.
        allowed_m: What it may cost at the targets [m].
        estimated_m: What it is estimated to cost [m]; None where that is not known.
        choice: What was chosen.
        reason: Why.
        counted: Whether the verdict on the tolerance counts it; that of meshes which are finer than what is known of a
            modulus is told beside it, where nobody asked for a tolerance.
    """

    source: str
    allowed_m: float
    estimated_m: float | None
    choice: str
    reason: str
    counted: bool = True


@dataclass(frozen=True)
class Verdict:
    """Whether a result keeps its tolerance.

    Attributes:
        kept: Whether it does, as far as is known.
        error_m: Error of the simulation: measured where it was verified, else estimated [m]; None
            where neither was done.
        short: Source of the entry that fell short most, or empty.
    """

    kept: bool
    error_m: float | None
    short: str


def verdict_on(budget: Sequence[BudgetEntry], tolerance: float, measured: float | None = None) -> Verdict:
    """Whether the errors of a budget keep a tolerance [m].

    The search has no part in it: what it leaves is an error of the performance, not of its prediction.

    Args:
        measured: Distance to a finer run on finer meshes, and the error of these [m], in place of all estimates.
    """
    if not budget and measured is None:
        return Verdict(False, None, "")
    counted = [entry for entry in budget if entry.source != SEARCH and entry.counted]
    error = sum(entry.estimated_m or 0.0 for entry in counted) if measured is None else measured
    if error <= tolerance:
        return Verdict(True, error, "")
    over = {entry.source: (entry.estimated_m or 0.0) - entry.allowed_m for entry in counted}
    if measured is not None:
        over = {MEASURED: measured - tolerance}
    return Verdict(False, error, max(over, key=lambda source: over[source], default=""))
