"""Asking operators whether they run, which can check their settings, and which would make the same value."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from calmotion.host.errors import PluginError
from calmotion.host.operators import Operator


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
