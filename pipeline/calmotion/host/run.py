"""Carrying out a plan: one result for each operator, also where others fail."""

from __future__ import annotations

import os
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeVar

from calmotion.host.errors import PluginError
from calmotion.host.operators import NotAsked, Operator, Record, RunContext
from calmotion.host.plan import Plan, adds_up, can_check, find_rivals, poll, will_run
from calmotion.host.properties import PropertyValues
from calmotion.model import Simplification
from calmotion.support import interrupts
from calmotion.support.memory import RESERVE, peak_memory, require_address_space
from calmotion.support.naming import as_written

T = TypeVar("T")
Progress = Callable[[str, float, str], None]
Reuse = Callable[[type[Operator], Mapping[type, Any]], "Sequence[object] | None"]


class Outcome(StrEnum):
    """The outcome of an operator in a run."""

    DONE = "done"
    LEFT_OUT = "left out"
    FAILED = "failed"
    BLOCKED = "blocked"


@dataclass(frozen=True)
class OperatorResult:
    """The outcome of one operator.

    Attributes:
        idname, label, plugin: Which operator, and the plugin it belongs to.
        outcome: `done`; `left out` by its poll; `failed` when it raised; `blocked` when an input is missing.
        reason: Why it did not run, or empty.
        error: What it raised, or None.
        traceback: Where, or empty.
        duration: [s].
        processor_s: Processor time of this process and of those that it started and that have ended [s].
        peak_memory_gb: Of this process, up to the end of the operator [GB]; NaN where that is not known.
        records: What it reported.
        progress: How far it came, 0..1; 1 for one that is done.
    """

    idname: str
    label: str
    plugin: str
    outcome: Outcome
    reason: str = ""
    error: Exception | SystemExit | None = None
    traceback: str = ""
    duration: float = 0.0
    processor_s: float = 0.0
    peak_memory_gb: float = 0.0
    records: tuple[Record, ...] = ()
    progress: float = 0.0

    @property
    def success(self) -> bool:
        """Whether it ran and made what it provides."""
        return self.outcome == Outcome.DONE


class Run:
    """A plan that is carried out by iterating over it, once.

    Attributes:
        plan: The plan.
        data: Type to value: what is known so far.
        results: One for each operator so far.
    """

    def __init__(
        self,
        plan: Plan,
        data: Mapping[type, Any],
        properties: Mapping[str, PropertyValues],
        owners: Mapping[str, str],
        progress: Progress | None = None,
        reuse: Reuse | None = None,
    ):
        self.plan = plan
        self.data: dict[type, Any] = dict(data)
        self.results: list[OperatorResult] = []
        self._failed: set[type] = set()
        self._made: dict[type, type[Operator]] = {}
        self._refused: dict[type, tuple[type[Operator], ...]] = {}
        self._lost: set[type] = set()  # values of operators that refuse their settings, which nothing else makes
        self._gone: set[type] = set()  # the same of operators that failed
        self._checked: dict[type[Operator], bool] = {}
        self._properties = properties
        self._owners = owners
        self._progress = progress or (lambda stage, fraction, message: None)
        self._reuse = reuse or (lambda cls, data: None)

    def get(self, kind: type[T]) -> T | None:
        """The value of a type, None while there is none."""
        return self.data.get(kind)

    def __iter__(self) -> Iterator[OperatorResult]:
        for index, cls in enumerate(self.plan.operators):
            # rivals are refused before any work that only they would use
            self._refused |= find_rivals(self.plan.operators[index:], self.data, self.plan.contested)
            interrupts.check()
            # settings are refused before any work that only they would use
            for refusal in self._check(self.plan.operators[index:]):
                self.results.append(refusal)
                yield refusal
            if self._checked.get(cls, True):
                result = self._step(cls)
                if result.outcome == Outcome.FAILED:
                    self._gone |= self._only_by(cls, self.plan.operators[index + 1 :])
                self.results.append(result)
                yield result

    def finish(self) -> Run:
        """Carry out all of it; returns itself."""
        for _ in self:
            pass
        return self

    def _check(self, remaining: Sequence[type[Operator]]) -> list[OperatorResult]:
        """Let the operators that have the values for it check their settings; one failure for each that refuses."""
        coming = {kind for cls in remaining for kind in cls.provides} - self.data.keys()
        refusals = []
        unknown = coming | self._failed
        # all that refuse are found at once
        ready = [cls for cls in remaining if cls not in self._checked and can_check(cls, self.data, unknown)]
        for cls in [cls for cls in ready if self._is_useful(cls)]:
            self._checked[cls] = True
            values = {kind: self.data[kind] for kind in cls.checks if kind in self.data}
            try:
                cls().check(RunContext(cls, values, self._properties[cls.idname]))
            except (Exception, SystemExit) as error:  # a plugin does not end the host
                interrupts.check()
                self._checked[cls] = False
                self._lost |= self._only_by(cls, remaining)
                refusals.append(self._failure(cls, error))
        return refusals

    def _only_by(self, cls: type[Operator], remaining: Sequence[type[Operator]]) -> set[type]:
        """What is missing where an operator fails, since no other one made it, or is certain to."""
        coming = {kind for one in remaining for kind in one.provides} - self.data.keys()
        others = [one for one in remaining if one is not cls and will_run(one, self.data, coming)]
        made = self.data.keys() | {kind for one in others for kind in one.provides}
        return {kind for kind in cls.provides if kind not in made or adds_up(kind)}

    def _is_useful(self, cls: type[Operator]) -> bool:
        """Whether an operator is still needed without the values that cannot be made.

        None is where settings of an operator whose values must come out are refused: the run then fails in any case.
        """
        if self._lost.intersection(self.plan.wanted):
            return False
        lost = self._refused.keys() | self._lost | self._gone
        return not lost or cls in self.plan.useful(lost, self.data)

    def _step(self, cls: type[Operator]) -> OperatorResult:
        rivals = [kind for kind in cls.provides if cls in self._refused.get(kind, ())]
        if rivals:
            return self._failure(cls, self._rivalry(rivals[0], self._refused[rivals[0]]))
        # A used value may be absent because nobody needs it, but not because making it failed.
        needs = (kind for kind in cls.requires + cls.uses if kind in self._failed)
        failed = [kind for kind in needs if kind not in self.data or adds_up(kind)]
        missing = failed or [kind for kind in cls.requires if kind not in self.data]
        if missing:
            self._failed |= set(cls.provides if failed else ())
            names = ", ".join(kind.__name__ for kind in missing)
            return self._result(cls, Outcome.BLOCKED, reason=f"there is no {names}")
        if not self._is_useful(cls):
            self._failed |= set(cls.provides)
            names = ", ".join(kind.__name__ for kind in self._refused or self._lost | self._gone)
            why = "more than one operator makes" if self._refused else "there is no"
            return self._result(cls, Outcome.BLOCKED, reason=f"{why} {names}")
        start = time.perf_counter(), _processor_time()
        context = RunContext(
            cls,
            dict(self.data),
            self._properties[cls.idname],
            lambda f, m: self._progress(cls.label, f, m),
            results=tuple(self.results),
        )
        try:
            reason = poll(cls, self.data)
            if reason is not None:
                return self._result(cls, Outcome.LEFT_OUT, reason=reason)
            for kind in cls.provides:
                if kind in self.data and not adds_up(kind):
                    made = (self._made[kind],) if kind in self._made else ()
                    raise self._rivalry(kind, (*made, cls))
            self._progress(cls.label, 0.0, "")
            require_address_space(RESERVE, "a stage")
            found = self._reuse(cls, self.data)
            with _working_folder():
                values = _checked(cls, cls().execute(context) if found is None else found)
            self._progress(cls.label, 1.0, "")
        except (Exception, SystemExit) as error:  # a plugin does not end the host
            interrupts.check()  # which it may have made of an interrupt
            return self._failure(cls, error, start, context)
        for kind, value in values.items():
            known = [self.data[kind]] if kind in self.data else []
            self.data[kind] = kind.joined([*known, value]) if adds_up(kind) else value  # type: ignore[attr-defined]
        self._made |= dict.fromkeys(values, cls)
        return self._result(cls, Outcome.DONE, **_cost(start), records=self._records(context), progress=1.0)

    def _result(self, cls: type[Operator], outcome: Outcome, **fields: Any) -> OperatorResult:
        return OperatorResult(cls.idname, cls.label, self._owners[cls.idname], outcome, **fields)

    def _records(self, context: RunContext) -> tuple[Record, ...]:
        """What an operator reported, with names of prims as the author of the shot wrote them."""
        from calmotion.model import Provenance

        provenance = self.data.get(Provenance)
        names = {} if provenance is None else provenance.names
        return tuple(Record(record.level, as_written(record.text, names)) for record in context.records)

    def _failure(
        self,
        cls: type[Operator],
        error: Exception | SystemExit,
        start: tuple[float, float] | None = None,
        context: RunContext | None = None,
    ) -> OperatorResult:
        self._failed |= set(cls.provides)
        return self._result(
            cls,
            Outcome.FAILED,
            reason=str(error) or type(error).__name__,
            error=error,
            traceback="".join(traceback.format_exception(error)),
            **({} if start is None else _cost(start)),
            records=self._records(context) if context else (),
            progress=context.fraction if context else 0.0,
        )

    def _rivalry(self, kind: type, rivals: Sequence[type[Operator]]) -> PluginError:
        """The error about operators that would make the same value: the choice is the user's."""
        return PluginError(
            f"more than one operator makes {kind.__name__}",
            found=", ".join(f"{one.idname} of the plugin {self._owners[one.idname]}" for one in rivals),
            remedy="Disable one of the plugins.",
        )

    def left_out(self) -> tuple[Simplification, ...]:
        """What the polls left out, for the report; not an operator whose values another one made, or whose
        output was not requested."""
        from calmotion.model import Simplification

        made = {cls.idname: all(kind in self.data for kind in cls.provides) for cls in self.plan.operators}
        return tuple(
            Simplification(result.label, result.reason, skipped=True)
            for result in self.results
            if result.outcome == Outcome.LEFT_OUT
            and not made[result.idname]
            and not isinstance(result.reason, NotAsked)
        )

    def failures(self) -> list[OperatorResult]:
        """The operators that raised."""
        return [result for result in self.results if result.outcome == Outcome.FAILED]


def _processor_time() -> float:
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _cost(start: tuple[float, float]) -> dict[str, float]:
    """Time, processor time and memory of an operator that began at a time and a processor time [s]."""
    duration, processor = time.perf_counter() - start[0], _processor_time() - start[1]
    return {"duration": duration, "processor_s": processor, "peak_memory_gb": peak_memory()}


@contextmanager
def _working_folder() -> Iterator[None]:
    """The working folder is the same afterwards, whatever a plugin does: names of outputs are relative to it."""
    before = _folder()
    try:
        yield
    finally:
        if before and _folder() != before:
            with suppress(OSError):
                os.chdir(before)


def _folder() -> str:
    """The working folder; empty where it was removed."""
    try:
        return os.getcwd()
    except OSError:
        return ""


def _checked(cls: type[Operator], values: object) -> dict[type, object]:
    expected = ", ".join(kind.__name__ for kind in cls.provides)
    if not isinstance(values, (tuple, list)) or len(values) != len(cls.provides):
        found = f"{len(values)} values" if isinstance(values, (tuple, list)) else type(values).__name__
        raise PluginError(
            f"operator {cls.idname} must return a sequence of ({expected})",
            found=found,
            remedy="Return the values in the order of `provides`.",
        )
    for kind, value in zip(cls.provides, values, strict=True):
        if not isinstance(value, kind):
            raise PluginError(
                f"operator {cls.idname} must return ({expected})", found=f"{type(value).__name__} for {kind.__name__}"
            )
    return dict(zip(cls.provides, values, strict=True))
