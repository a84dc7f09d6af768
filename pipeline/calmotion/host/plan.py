"""Ordering operators by what they require and provide; which run, and which would make the same value."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from typing import Any

from calmotion.host.errors import PlanError, PluginError
from calmotion.host.operators import Operator

Operators = Sequence[type[Operator]]


def adds_up(kind: type) -> bool:
    """Whether several operators may make values of a type: it has a class method `joined` that takes all of them."""
    return callable(getattr(kind, "joined", None))


@dataclass(frozen=True)
class Plan:
    """What runs, in order.

    Attributes:
        operators: Every operator that the wanted types may need, providers before users.
        wanted: Types that must come out.
        optional: Types that are made where they can be.
    """

    operators: tuple[type[Operator], ...]
    wanted: tuple[type, ...]
    optional: tuple[type, ...]

    @cached_property
    def contested(self) -> frozenset[type]:
        """Types that more than one operator makes, and one may."""
        makers = Counter(kind for cls in self.operators for kind in cls.provides)
        return frozenset(kind for kind, count in makers.items() if count > 1 and not adds_up(kind))

    def useful(self, lost: Collection[type], known: Collection[type]) -> set[type[Operator]]:
        """The operators that are still needed where some types cannot be made.

        Args:
            lost: Types that cannot be made.
            known: Types whose values are there.
        """
        gone, have, able = set(lost), set(known), []
        for cls in self.operators:
            if gone.intersection((*cls.requires, *cls.uses, *cls.provides)):
                gone.update(cls.provides)
            elif have.issuperset(cls.requires):
                able.append(cls)
                have.update(cls.provides)
        return set(_closure(able, [*known], [*self.wanted, *self.optional]))


def make_plan(
    operators: Operators,
    given: Sequence[type],
    wanted: Sequence[type],
    optional: Sequence[type] = (),
    broken: Sequence[str] = (),
) -> Plan:
    """Choose the operators that the wanted types need, and order them.

    Args:
        given: Types whose values are known already.
        wanted: Types that must come out.
        optional: Types that are made where some operator can.
        broken: Plugins that failed, for the message when something is missing.

    Raises:
        PlanError: When a wanted type cannot be made (naming what is missing), or operators need each other in
            a circle (naming it).
    """
    needed = _closure(operators, given, [*wanted, *optional])
    order = _sort(needed)
    able: list[type[Operator]] = []
    known = set(given)
    for cls in order:
        if known.issuperset(cls.requires):
            able.append(cls)
            known.update(cls.provides)
    for kind in wanted:
        if kind not in known:
            raise _missing(kind, needed, known, broken)
    # Without what cannot run, others may no longer be needed.
    kept = set(_closure(able, given, [*wanted, *optional]))
    return Plan(tuple(cls for cls in able if cls in kept), tuple(wanted), tuple(optional))


def _closure(operators: Operators, given: Sequence[type], kinds: Sequence[type]) -> list[type[Operator]]:
    """Every operator that some of the types may need; those of earlier types first."""
    needed: list[type[Operator]] = []
    seen = set(given)
    queue = list(kinds)
    while queue:
        kind = queue.pop(0)
        if kind in seen:
            continue
        seen.add(kind)
        for cls in operators:
            if kind in cls.provides and cls not in needed:
                needed.append(cls)
                queue += cls.requires + cls.uses
    return needed


def _sort(operators: Operators) -> list[type[Operator]]:
    makers: dict[type, list[type[Operator]]] = {}
    for cls in operators:
        for kind in cls.provides:
            makers.setdefault(kind, []).append(cls)
    sorter: TopologicalSorter[type[Operator]] = TopologicalSorter()
    for cls in operators:
        sorter.add(cls, *(maker for kind in cls.requires + cls.uses for maker in makers.get(kind, ())))
    try:
        sorter.prepare()
    except CycleError as error:
        circle = " -> ".join(cls.idname for cls in reversed(error.args[1]))
        raise PlanError(
            "operators need each other in a circle", found=circle, remedy="Disable one of their plugins."
        ) from None
    order: list[type[Operator]] = []
    rank = {cls: index for index, cls in enumerate(operators)}
    while sorter.is_active():
        ready = sorted(sorter.get_ready(), key=lambda cls: rank[cls])
        order += ready
        sorter.done(*ready)
    return order


def _missing(kind: type, needed: Operators, known: set[type], broken: Sequence[str]) -> PlanError:
    """The error that names what is missing at the root of an unreachable type."""
    while makers := [cls for cls in needed if kind in cls.provides]:
        lacking = [required for required in makers[0].requires if required not in known]
        if not lacking:
            break
        kind = lacking[0]
    users = sorted(cls.idname for cls in needed if kind in cls.requires)
    problem = f"no operator provides {kind.__name__}" + (f", which {', '.join(users)} needs" if users else "")
    remedy = f"Plugins that are not there: {'; '.join(broken)}" if broken else "Install a plugin that provides it."
    return PlanError(problem, remedy=remedy.rstrip("."))


class _Watched(dict[type, Any]):
    """Data of a run that remembers which absent values a poll has read."""

    def __init__(self, data: Mapping[type, Any]):
        super().__init__(data)
        self.absent: set[type] = set()

    def __missing__(self, kind: type) -> Any:
        self.absent.add(kind)
        raise KeyError(kind)

    def __contains__(self, kind: object) -> bool:
        there = super().__contains__(kind)
        if not there and isinstance(kind, type):
            self.absent.add(kind)
        return there

    def get(self, kind: type, default: Any = None) -> Any:
        return self[kind] if kind in self else default


def poll(cls: type[Operator], data: Mapping[type, Any]) -> str | None:
    """None when an operator runs on this data, else the reason why it does not.

    Raises:
        PluginError: The answer is neither.
        Exception: Whatever the operator's poll raises.
    """
    reason = cls.poll(dict(data))
    if reason is not None and not (isinstance(reason, str) and reason.strip()):
        raise PluginError(
            f"poll of {cls.idname} must return None or a reason", found=repr(reason), remedy="Return a text."
        )
    return reason


def will_run(cls: type[Operator], data: Mapping[type, Any], coming: Collection[type]) -> bool:
    """Whether an operator is certain to run once its inputs are there.

    False where its poll declines or raises, and where it asks for a value that may still come: the answer may change.
    """
    watched = _Watched(data)
    try:
        reason = cls.poll(watched)
    except Exception:
        return False  # it fails by itself when its turn comes
    return reason is None and not watched.absent.intersection(coming)


def find_rivals(
    remaining: Sequence[type[Operator]], data: Mapping[type, Any], contested: Collection[type]
) -> dict[type, tuple[type[Operator], ...]]:
    """Operators that are certain to make the same value, by the value's type.

    Args:
        remaining: Operators of the plan that have not run.
        data: What is known.
        contested: Types that more than one operator of the plan makes.
    """
    coming = {kind for cls in remaining for kind in cls.provides} - data.keys()
    rivals = {}
    for kind in coming.intersection(contested):
        makers = tuple(cls for cls in remaining if kind in cls.provides and will_run(cls, data, coming))
        if len(makers) > 1:
            rivals[kind] = makers
    return rivals


def can_check(cls: type[Operator], data: Mapping[type, Any], coming: Collection[type]) -> bool:
    """Whether an operator that is certain to run has all values from which it checks its settings.

    Args:
        data: What is known.
        coming: Types whose values may still come.
    """
    if not cls.checks or any(kind in coming for kind in cls.checks):
        return False
    there = all(kind in data for kind in cls.checks if kind in cls.requires)
    return there and will_run(cls, data, coming)
