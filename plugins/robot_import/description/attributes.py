"""What becomes of each attribute of URDF and MJCF: the table `attributes.toml`, and what it says of a robot."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

from calmotion.errors import ShotError, raise_all

READ, NOTED, REFUSED, NO_EFFECT = "read", "noted", "refused", "no effect"
TREATMENTS = (READ, NOTED, REFUSED, NO_EFFECT)
PRESENT = "element"  # in the table: that the element is there at all
_ANYTHING = "*"
_SHOWN = 8  # names in a note
_SWITCHES = {"true": "1", "enable": "1", "false": "0", "disable": "0"}


@dataclass(frozen=True)
class Element:
    """An element of a robot's file.

    Attributes:
        place: Its tags below the root, as `body/joint`; bodies within bodies count once.
        name: Its own, or that of the joint or link that it is about.
        file: Where it is.
        values: Its attributes, with those that its class gives it.
    """

    place: str
    name: str
    file: str
    values: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Row:
    """What becomes of some attributes of some elements.

    Attributes:
        elements: Patterns of their places.
        attributes: Patterns of their names; `PRESENT` is any element of that place.
        treatment: One of `TREATMENTS`.
        text: What it becomes, or why it has no effect; the sentence of a note or of an error.
        remedy: What to change, of a refused one.
        harmless: Words that change nothing, `*` for any, `|` between several: the attribute is not noted, nor refused,
            where it has them.
    """

    elements: tuple[str, ...]
    attributes: tuple[str, ...]
    treatment: str
    text: str
    remedy: str = ""
    harmless: tuple[str, ...] = ()

    def is_about(self, place: str, attribute: str) -> bool:
        """Whether it says what becomes of an attribute."""
        return any(fnmatchcase(place, e) for e in self.elements) and any(
            fnmatchcase(attribute, a) for a in self.attributes
        )

    def matters(self, value: str) -> bool:
        """Whether a value changes the robot; words that are left out change nothing."""
        words = value.split()
        return bool(words) and any(
            not any(_same(word, allowed) for allowed in choices.split("|"))
            for word, choices in zip(words, self.harmless or ("",) * len(words), strict=False)
        )


@cache
def table(kind: str) -> tuple[Row, ...]:
    """The rows of a kind of file, `urdf` or `mjcf`; the first that is about an attribute counts."""
    rows = tomllib.loads(Path(__file__).with_name("attributes.toml").read_text(encoding="utf-8"))[kind]
    return tuple(
        Row(
            tuple(row["elements"].split()), tuple(row["attributes"].split()), row["treatment"], row["text"],
            row.get("remedy", ""), tuple(row.get("harmless", "").split()),
        )
        for row in rows
    )  # fmt: skip


def row_of(kind: str, place: str, attribute: str) -> Row | None:
    """What becomes of an attribute; None where the table does not know it."""
    return next((row for row in table(kind) if row.is_about(place, attribute)), None)


def judged(kind: str, elements: Iterable[Element]) -> tuple[str, ...]:
    """What a robot has that is not read, as sentences for the user.

    Raises:
        ShotError: Attributes that the table refuses.
    """
    notes: dict[str, list[str]] = {}
    problems: list[ShotError] = []
    for element in elements:
        for attribute, value in ((PRESENT, element.name or element.place), *element.values.items()):
            row = row_of(kind, element.place, attribute)
            words = (*element.place.removeprefix("body/").split("/"), element.name, attribute)
            shown = " ".join(word for word in words if word and word != PRESENT)
            if row is None and attribute != PRESENT:
                notes.setdefault("attributes that are not known, and not read", []).append(shown)
            elif row is not None and row.treatment in (NOTED, REFUSED) and row.matters(value):
                if row.treatment == NOTED:
                    notes.setdefault(row.text, []).append(element.name or shown)
                else:
                    problems.append(
                        ShotError(row.text, path=element.file, attribute=shown, found=value, remedy=row.remedy)
                    )
    raise_all(problems)
    return tuple(f"{text}: {_listed(names)}" for text, names in notes.items())


def markdown(kind: str) -> str:
    """The table of a kind of file as a page shows it."""
    lines = ["| element | attributes | here | meaning |", "| --- | --- | --- | --- |"]
    for row in sorted(table(kind), key=lambda row: TREATMENTS.index(row.treatment)):
        names = ", ".join(
            "all" if name == _ANYTHING else "(any)" if name == PRESENT else name for name in row.attributes
        )
        text = row.text + (f". {row.remedy}" if row.remedy else "")
        text += f"; `{' '.join(row.harmless)}` is accepted" if row.harmless else ""
        lines.append(f"| {_code(row.elements)} | {names} | {row.treatment} | {text} |")
    return "\n".join(lines)


def _same(word: str, allowed: str) -> bool:
    word, allowed = _SWITCHES.get(word, word), _SWITCHES.get(allowed, allowed)
    try:
        return allowed == _ANYTHING or float(word) == float(allowed)
    except ValueError:
        return word == allowed


def _listed(names: Sequence[str]) -> str:
    found = list(dict.fromkeys(names))
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return ", ".join(found[:_SHOWN]) + more


def _code(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}`" for name in names)
