"""The state of reading a stage: its units, poses at the first frame, and collected notes, warnings and errors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeVar

from pxr import Usd, UsdGeom

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.usd.gf import matrix
from calmotion.usd.schemas import is_applied
from calmotion.usd.transforms import Pose, pose_from_matrix, refuse_infinite
from calmotion.usd.units import StageUnits

RIGID_BODY = "PhysicsRigidBodyAPI"

T = TypeVar("T")
R = TypeVar("R")


@dataclass(eq=False)
class Reading:
    """The stage that is being read.

    Attributes:
        stage: The Usd.Stage.
        units: Its units.
        start: Time code of the first frame.
        notes: Sentences for the user about assumptions where the shot does not say.
        problems: Errors of the shot that were found so far.
        warnings: What can be processed, but not exactly as authored; also among the notes.
        whole: The stage with all of its prims, where `stage` holds a part of it; None: it is whole.
    """

    stage: Any
    units: StageUnits
    start: float
    notes: list[str] = field(default_factory=list)
    problems: list[ShotError] = field(default_factory=list)
    warnings: list[ShotError] = field(default_factory=list)
    whole: Any = None

    def __post_init__(self) -> None:
        self._xforms = UsdGeom.XformCache(self.start)

    def note(self, text: str) -> None:
        """Add a sentence for the user, unless it is there already."""
        if text not in self.notes:
            self.notes.append(text)

    def warn(self, problem: ShotError) -> None:
        """Add a warning, and a note for the user."""
        self.warnings.append(problem)
        self.note(problem.message())

    @contextmanager
    def collecting_problems(self) -> Iterator[None]:
        """Add the ShotError that ends this block to the problems, so that one reading finds all of them."""
        try:
            yield
        except ShotError as problem:
            self.problems.append(problem)

    def each(self, elements: Iterable[T], read: Callable[[T], R]) -> list[R]:
        """Read each element; a ShotError of one is added to the problems, and the others are still read."""
        values = []
        for element in elements:
            with self.collecting_problems():
                values.append(read(element))
        return values

    def at(self, code: float) -> Reading:
        """The same stage at another time code, with empty notes."""
        return Reading(self.stage, self.units, code)

    def world_matrix(self, prim: Usd.Prim) -> Array:
        """Local-to-world matrix [4, 4] of a prim at the first frame, stage units, mapping column vectors; a ShotError
        where it is not finite."""
        world = matrix(self._xforms.GetLocalToWorldTransform(prim))
        refuse_infinite(world, str(prim.GetPath()))
        return world

    def pose(self, prim: Usd.Prim) -> Pose:
        """World pose of a prim at the first frame, stage units; a ShotError if it shears."""
        return pose_from_matrix(self.world_matrix(prim), str(prim.GetPath()))


def prims_of(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """Every prim of a stage in depth-first order, those inside instances too."""
    return iter(stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))


def prims_below(prim: Usd.Prim, stop: Callable[[Usd.Prim], bool]) -> Iterator[Usd.Prim]:
    """A prim and those below it, depth first, not entering a prim below it for which `stop` holds."""
    walk = iter(Usd.PrimRange(prim, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for below in walk:
        if below != prim and stop(below):
            walk.PruneChildren()
            continue
        yield below


def body_on(stage: Usd.Stage, prim: Usd.Prim, side: int) -> str:
    """Path of the body on a side of a joint's prim, as authored; empty for the world."""
    relationship = prim.GetRelationship(f"physics:body{side}")
    for target in relationship.GetForwardedTargets() if relationship else []:
        body = carrying_body(stage.GetPrimAtPath(target))
        return str(body.GetPath()) if body else ""
    return ""


def carrying_body(prim: Usd.Prim) -> Usd.Prim:
    """The body that a prim is or lies below; an invalid prim where there is none."""
    while prim and not is_rigid_body(prim):
        prim = prim.GetParent()
    return prim


def switched_off_body(prim: Usd.Prim) -> Usd.Prim | None:
    """The body that a prim is or lies below where no body carries it, since `physics:rigidBodyEnabled` switches it off;
    None otherwise."""
    if carrying_body(prim):
        return None
    while prim and not is_applied(prim, RIGID_BODY):
        prim = prim.GetParent()
    return prim or None


def refuse_without_transform(prim: Usd.Prim, what: str) -> None:
    """Refuse a prim that has no transform.

    Args:
        what: It stands for, such as `a target`.
    """
    if not prim.IsA(UsdGeom.Xformable):
        raise ShotError(
            f"{what} needs a transform",
            path=prim.GetPath(),
            found=prim.GetTypeName() or "a prim without a type",
            remedy="Make it an Xform",
        )


def is_rigid_body(prim: Usd.Prim) -> bool:
    """Whether a prim is an enabled rigid body."""
    if not is_applied(prim, RIGID_BODY):
        return False
    enabled = prim.GetAttribute("physics:rigidBodyEnabled")
    return not enabled or enabled.Get() is not False
