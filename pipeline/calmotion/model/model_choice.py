"""What a shot needs of all that could be simulated, decided before anything heavy is loaded or computed."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from calmotion.model.character import Character
from calmotion.model.result import Result, Simplification
from calmotion.model.run import RunSettings, Source
from calmotion.model.tolerance import CHOICES

# What can be forced on or off.
KINDS = ("bodies", "turning", "loops", "modes", "directions", "elasticity", "motors")
AUTO, ON, OFF = "auto", "on", "off"


@dataclass(frozen=True)
class ModelChoice:
    """One thing that a shot may need.

    Attributes:
        kind: One of `KINDS`, or `step` and `knots`, which have options of their own.
        what: The thing, in the user's words.
        needed: Whether it is there.
        why: The reason.
        estimated_error_m: What leaving it out costs at the targets, or would cost [m]; None: nothing, or not known.
        forced: Whether the user chose.
    """

    kind: str
    what: str
    needed: bool
    why: str
    estimated_error_m: float | None = None
    forced: bool = False


@dataclass(frozen=True, eq=False)
class ModelChoices:
    """What a shot needs.

    Attributes:
        character: The shot's character, marked with what is left out of it.
        rows: Every decision.
        forced: Kinds that the user forced, `on` or `off`.
        notes: What was noticed of the shot, as sentences for the user.
    """

    character: Character
    rows: tuple[ModelChoice, ...] = ()
    forced: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def left_out(self) -> tuple[Simplification, ...]:
        """What is left out, for the report."""
        return self.left_out_but()

    def left_out_but(self, *kinds: str) -> tuple[Simplification, ...]:
        """The same without some kinds."""
        rows = (row for row in self.rows if not row.needed and row.kind not in kinds)
        return tuple(Simplification(row.what, row.why, row.estimated_error_m, CHOICES) for row in rows)

    def choice(self, kind: str) -> str:
        """`auto`, `on` or `off`."""
        return self.forced.get(kind, AUTO)


def run_settings(source: Source | None, choices: ModelChoices | None = None, **more: Any) -> RunSettings:
    """The settings of a run.

    Args:
        source: Settings of the user; None: the shot and the program choose everything.
        choices: Simplifications, some of which the user may have forced.
        more: Other fields of the settings.
    """
    if choices is not None:
        more |= {kind: choices.choice(kind) for kind in ("directions", "motors")}
    return replace(RunSettings() if source is None else source.settings, **more)


def simplified_character(character: Character, choices: ModelChoices | None) -> Character:
    """The character, marked with its simplifications where they are known."""
    return character if choices is None else choices.character


def with_choices(result: Result, choices: ModelChoices | None) -> Result:
    """A result whose simplifications and estimated error include those of the model."""
    if choices is None:
        return result
    accuracy = result.accuracy
    if accuracy is not None:
        error = sum(row.estimated_error_m or 0.0 for row in choices.left_out)
        accuracy = replace(accuracy, left_out_m=accuracy.left_out_m + error, choices_m=error)
    # a search reports more about its motors
    rows = choices.left_out if result.after is None else choices.left_out_but("motors")
    return replace(result, left_out=(*rows, *result.left_out), accuracy=accuracy)


def no_flexible_bodies(data: Mapping[type, Any]) -> str | None:
    """The reason why a step for flexible bodies is not needed, None where it is.

    Args:
        data: What is known of the run, by type.
    """
    character, choices = data.get(Character), data.get(ModelChoices)
    if character is not None and not any(body.flexible for body in character.bodies):
        return "nothing is flexible: no body has CalmFlexibleBodyAPI"
    if choices is not None and not any(body.simulated_flexible for body in choices.character.bodies):
        return "the user forced all bodies to be rigid"
    return None
