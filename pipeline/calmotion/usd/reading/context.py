"""What every part of the reader needs: the stage, its units, poses at the first frame, and a place for notes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from calmotion.errors import ShotError
from calmotion.shot.character import Array
from calmotion.usd.gf import matrix
from calmotion.usd.schemas import is_applied
from calmotion.usd.transforms import Pose, pose_from_matrix, refuse_infinite
from calmotion.usd.units import StageUnits

if TYPE_CHECKING:
    from pxr import Usd

T = TypeVar("T")
R = TypeVar("R")


@dataclass(eq=False)
class Reading:
    """The stage that is being read.

    Attributes:
        stage: The Usd.Stage.
        units: Its units.
        start: Time code of the first frame.
        notes: Sentences for the user about what was decided where the shot was silent.
        problems: What is wrong with the shot, as far as it was read.
        doubts: What can be processed, but not as it is authored; notes for the user, too.
    """

    stage: Any
    units: StageUnits
    start: float
    notes: list[str] = field(default_factory=list)
    problems: list[ShotError] = field(default_factory=list)
    doubts: list[ShotError] = field(default_factory=list)

    def __post_init__(self) -> None:
        from pxr import UsdGeom

        self._xforms = UsdGeom.XformCache(self.start)

    def note(self, text: str) -> None:
        """Keep a sentence for the user, once."""
        if text not in self.notes:
            self.notes.append(text)

    def doubt(self, problem: ShotError) -> None:
        """Keep what can be processed, but not as it is authored, and tell the user."""
        self.doubts.append(problem)
        self.note(problem.message())

    @contextmanager
    def going_on(self) -> Iterator[None]:
        """Keep the problem that ends this block, so that one reading finds all of them."""
        try:
            yield
        except ShotError as problem:
            self.problems.append(problem)

    def each(self, items: Iterable[T], read: Callable[[T], R]) -> list[R]:
        """What is read of each item, the problems of some kept and the others read all the same."""
        found = []
        for item in items:
            with self.going_on():
                found.append(read(item))
        return found

    def at(self, code: float) -> Reading:
        """The same stage at another time code; what it notes is not kept."""
        return Reading(self.stage, self.units, code)

    def world_matrix(self, prim: Usd.Prim) -> Array:
        """Local-to-world matrix [4, 4] of a prim at the first frame, stage units, mapping column vectors; a ShotError
        where it is not finite."""
        found = matrix(self._xforms.GetLocalToWorldTransform(prim))
        refuse_infinite(found, str(prim.GetPath()))
        return found

    def pose(self, prim: Usd.Prim) -> Pose:
        """World pose of a prim at the first frame, stage units; a ShotError if it shears."""
        return pose_from_matrix(self.world_matrix(prim), str(prim.GetPath()))


def grouped(notes: list[str]) -> tuple[str, ...]:
    """Notes with those that say the same of several prims put into one."""
    groups: dict[str, list[str]] = {}
    for note in notes:
        place, colon, text = note.partition(": ")
        groups.setdefault(text if colon and place.startswith("/") else note, []).append(place)
    found = []
    for text, places in groups.items():
        if text.startswith(places[0]) and len(places) == 1:
            found.append(text)
        else:
            more = f" and {len(places) - 1} others" if len(places) > 1 else ""
            found.append(f"{places[0]}{more}: {text}")
    return tuple(found)


def prims_of(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """Every prim of a stage in depth-first order, those inside instances too."""
    from pxr import Usd

    return iter(stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))


def prims_below(prim: Usd.Prim, stop: Callable[[Usd.Prim], bool]) -> Iterator[Usd.Prim]:
    """A prim and those below it, depth first, not entering a prim below it for which `stop` holds."""
    from pxr import Usd

    walk = iter(Usd.PrimRange(prim, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for below in walk:
        if below != prim and stop(below):
            walk.PruneChildren()
            continue
        yield below


def is_rigid_body(prim: Usd.Prim) -> bool:
    """Whether a prim is an enabled rigid body."""
    if not is_applied(prim, "PhysicsRigidBodyAPI"):
        return False
    enabled = prim.GetAttribute("physics:rigidBodyEnabled")
    return not enabled or enabled.Get() is not False
