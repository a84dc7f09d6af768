"""Operators, the steps that plugins add, and their context while they run."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, TypeVar

from calmotion.host.errors import PluginError
from calmotion.host.properties import Property, PropertyValues

T = TypeVar("T")
LEVELS = ("detail", "info", "warning")


@dataclass(frozen=True)
class Record:
    """Something an operator reports to the user; `level` is `detail` (shown with `--verbose`), `info` or `warning`."""

    level: str
    text: str


@dataclass
class RunContext:
    """The context of a running operator: its inputs, properties, progress and messages.

    Attributes:
        operator: The operator's class.
        data: Type to value: everything that is known when it starts.
        properties: Values of its properties.
        on_progress: Called with a fraction in 0..1 and a message.
        records: What it reported so far.
        results: Outcomes of the earlier operators.
        fraction: How far it said that it is, 0..1.
    """

    operator: type[Operator]
    data: Mapping[type, Any]
    properties: PropertyValues
    on_progress: Callable[[float, str], None] = lambda fraction, message: None
    records: list[Record] = field(default_factory=list)
    results: Sequence[Any] = ()
    fraction: float = 0.0

    def get(self, kind: type[T]) -> T:
        """The value of a type; None for one of `uses` that no operator provided.

        Raises:
            PluginError: When the operator does not declare the type, since the order then does not know of it.
        """
        if kind not in self.operator.requires + self.operator.uses:
            raise PluginError(
                f"operator {self.operator.idname} reads {kind.__name__}, which it does not declare",
                remedy="Add the type to its `requires` or `uses`.",
            )
        return self.data.get(kind)  # type: ignore[return-value]

    def progress(self, fraction: float, message: str = "") -> None:
        """Report the progress of the operator, 0..1."""
        self.fraction = min(max(float(fraction), 0.0), 1.0)
        self.on_progress(self.fraction, message)

    def report(self, level: str, text: str) -> None:
        """Report a message to the user; `level` is `detail` (shown with `--verbose`), `info` or `warning`."""
        if level not in LEVELS:
            raise PluginError("unknown level of a report", found=level, remedy=f"Use one of {', '.join(LEVELS)}.")
        self.records.append(Record(level, text))


class NotAsked(str):
    """A reason of a poll that is not reported: the user did not request the output."""


class Operator:
    """Base of the operators that plugins register.

    Attributes:
        idname: Unique name with a dot, such as `fe.mesh`.
        label: What it does, in a few words, for progress and lists.
        requires: Types that must exist before it runs.
        uses: Types that are made first where some operator provides them and its poll says yes.
        provides: Types that it makes.
        properties: What can be set.
        checks: Types among `requires` and `uses` from which `check` refuses what `execute` would refuse.
        named: Attributes that operators of this base have to fill in.
    """

    idname: ClassVar[str] = ""
    label: ClassVar[str] = ""
    requires: ClassVar[tuple[type, ...]] = ()
    uses: ClassVar[tuple[type, ...]] = ()
    provides: ClassVar[tuple[type, ...]] = ()
    properties: ClassVar[tuple[Property, ...]] = ()
    checks: ClassVar[tuple[type, ...]] = ()
    named: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """None when it runs on this data, else the reason why it is left out, as a clause for the user (`NotAsked`
        where it need not be reported)."""
        return None

    def check(self, context: RunContext) -> None:
        """Raise ShotError for settings and input that `execute` would refuse.

        Called as soon as the values of `checks` are known, before the costly steps of operators in between. The
        context has no other values.
        """

    def execute(self, context: RunContext) -> Sequence[object]:
        """Make the values it provides, in the order of `provides`."""
        raise NotImplementedError


def check_operator(cls: object) -> None:
    """Check that a class is a well-formed operator.

    Raises:
        PluginError: The message says what is wrong with which operator.
    """
    if not (isinstance(cls, type) and issubclass(cls, Operator)):
        raise PluginError("only classes derived from calmotion.host.Operator can be registered", found=repr(cls))
    name = cls.idname if isinstance(cls.idname, str) and cls.idname else cls.__name__

    def refuse(problem: str, found: object = None, remedy: str = "") -> None:
        raise PluginError(problem, path=f"operator {name}", found=found, remedy=remedy)

    if not (isinstance(cls.idname, str) and re.fullmatch(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)+", cls.idname)):
        refuse("idname must be lower-case names separated by dots", repr(cls.idname), "Write one like fe.mesh.")
    if not (isinstance(cls.label, str) and cls.label.strip()):
        refuse("label is empty", remedy="Say in a few words what it does.")
    for attribute in ("requires", "uses", "provides", "checks"):
        kinds = getattr(cls, attribute)
        if not (isinstance(kinds, tuple) and all(isinstance(kind, type) for kind in kinds)):
            refuse(f"{attribute} must be a tuple of types", repr(kinds))
        if len(set(kinds)) != len(kinds):
            refuse(f"{attribute} names a type twice", repr(kinds))
    if not cls.provides:
        refuse("provides is empty", remedy="An operator makes at least one value.")
    both = set(cls.provides) & set(cls.requires + cls.uses) | set(cls.requires) & set(cls.uses)
    if both:
        refuse("a type is in two of requires, uses and provides", ", ".join(sorted(k.__name__ for k in both)))
    if not (isinstance(cls.properties, tuple) and all(isinstance(p, Property) for p in cls.properties)):
        refuse("properties must be a tuple of Property", repr(cls.properties))
    if len({p.name for p in cls.properties}) != len(cls.properties):
        refuse("two properties have the same name", ", ".join(p.name for p in cls.properties))
    for declared in cls.properties:
        try:
            declared.check()
        except PluginError as error:
            refuse(error.problem, error.found, error.remedy)
    foreign = set(cls.checks) - set(cls.requires + cls.uses)
    if foreign:
        names = ", ".join(sorted(kind.__name__ for kind in foreign))
        refuse("checks names a type that is in neither requires nor uses", names, "Add it to one of them.")
    if bool(cls.checks) != (cls.check is not Operator.check):
        refuse("checks and check belong together", remedy="Name in `checks` the types that `check` reads.")
    if cls.execute is Operator.execute:
        refuse("execute is missing")
    lacking = [*(name for name in cls.named if not getattr(cls, name)), *getattr(cls, "__abstractmethods__", ())]
    if lacking:
        refuse(f"it lacks {', '.join(lacking)}", remedy=f"Define them as {cls.__mro__[1].__name__} describes.")
    for method, arguments in (("poll", [{}]), ("check", [None, None]), ("execute", [None, None])):
        try:
            inspect.signature(getattr(cls, method)).bind(*arguments)
        except TypeError as error:
            refuse(f"{method} has a wrong signature: {error}", remedy="See calmotion.host.Operator.")
    try:
        inspect.signature(cls).bind()
    except TypeError:
        refuse("the class cannot be made without arguments")


def registration(*operators: type[Operator]) -> tuple[Callable[[Any], None], Callable[[Any], None]]:
    """`register` and `unregister` for these operators: `register, unregister = registration(First, Second)`."""

    def register(host: Any) -> None:
        """Register the operators."""
        for operator in operators:
            host.register_operator(operator)

    def unregister(host: Any) -> None:
        """Undo `register`."""
        for operator in reversed(operators):
            host.unregister_operator(operator)

    return register, unregister
