"""What went wrong in a run: the errors, the operators that raised them, and how they reach the caller."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from calmotion.errors import ShotError, ShotErrors, each, failure_of_machine
from calmotion.host import HostError, OperatorResult, Run
from calmotion.support.memory import was_short

T = TypeVar("T")


@dataclass(frozen=True)
class Problem:
    """An error of a run.

    Attributes:
        error: The error.
        operator, plugin: Where it was raised; empty when it concerns the whole run.
        traceback: Text of the traceback, only where the plugin's author needs it.
    """

    error: ShotError
    operator: str = ""
    plugin: str = ""
    traceback: str = ""

    def as_dict(self) -> dict[str, str]:
        """The fields, as `--json` prints them."""
        owner = {"operator": self.operator, "plugin": self.plugin, "traceback": self.traceback}
        return self.error.as_dict() | {key: value for key, value in owner.items() if value}


class RunError(ShotErrors):
    """A run that made no result.

    Attributes:
        problems: Every problem, with the operator and the plugin that it came from.
    """

    def __init__(self, problems: Sequence[Problem]):
        self.problems = tuple(problems)
        super().__init__([problem.error for problem in problems])


class Cancelled(Exception):
    """The caller's `cancel` stopped a run before it had a result."""


def problems_of(run: Run, wanted: Sequence[type]) -> list[Problem]:
    """The errors of operators that raised; without any, the wanted values that no operator made, with the reasons."""
    problems = [problem for result in run.failures() for problem in _problems(result)]
    if problems:
        return problems
    for kind in wanted:
        if run.get(kind) is None:
            makers = [cls for cls in run.plan.operators if kind in cls.provides]
            what = f"the step `{makers[0].label}` cannot be done" if makers else f"no operator makes {kind.__name__}"
            reasons = "; ".join(_reasons(run, kind, frozenset()))
            remedy = "Leave out the option that asks for it, or give the shot what it lacks" if reasons else ""
            problems.append(Problem(HostError(what, found=reasons or None, remedy=remedy)))
    return problems


def _reasons(run: Run, kind: type, seen: frozenset[type]) -> list[str]:
    """Why a value was not made: the reasons of the operators at the begin of the chain, not "there is no ..."."""
    rows = {row.idname: row for row in run.results}
    found: dict[str, None] = {}
    for cls in run.plan.operators:
        if kind not in cls.provides or cls.idname not in rows:
            continue
        missing = [need for need in cls.requires if run.get(need) is None and need not in seen and need is not kind]
        deeper = [reason for need in missing for reason in _reasons(run, need, seen | {kind})]
        found |= dict.fromkeys(deeper or [rows[cls.idname].reason])
    return [reason for reason in found if reason]


def value_of(run: Run, kind: type[T], problems: Sequence[Problem] = ()) -> T:
    """The value of a type that a run has made.

    Args:
        problems: What went wrong in the run, where that is known already.

    Raises:
        RunError: The run did not make it.
    """
    value = run.get(kind)
    if value is None:
        raise RunError(problems or problems_of(run, [kind]))
    return value


def _problems(result: OperatorResult) -> list[Problem]:
    error = result.error
    # The user can solve a ShotError and what the machine lacks; anything else is the plugin's, with the traceback.
    if isinstance(error, ShotError):
        return [Problem(one, result.idname, result.plugin) for one in each(error)]
    failure = None if error is None else failure_of_machine(error, was_short())
    if failure is not None:
        return [Problem(failure, result.idname, result.plugin)]
    raised = HostError(
        f"the operator {result.idname} of the plugin {result.plugin} raised {type(error).__name__}",
        found=str(error) or None,
        remedy="Report this to the plugin's maintainer, with the traceback.",
    )
    raised.__cause__ = error
    return [Problem(raised, result.idname, result.plugin, result.traceback)]
