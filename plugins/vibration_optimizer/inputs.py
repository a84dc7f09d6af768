"""What the operators read of a run, in the engine's words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from calmotion.accuracy.reduced_bodies import ReducedBodies
from calmotion.host import RunContext
from calmotion.shot import Animation, Character, ModelChoices, Result
from calmotion.shot.run import Source

if TYPE_CHECKING:
    from calmotion.simulation.settings import Options


def inputs(context: RunContext) -> tuple[Character, Animation, Sequence[Any] | None]:
    reduced = context.get(ReducedBodies)
    return character_of(context), context.get(Animation), None if reduced is None else reduced.bodies


def character_of(context: RunContext) -> Character:
    """The character, marked with what the shot does not need of it."""
    needs = context.get(ModelChoices)
    return context.get(Character) if needs is None else needs.character


def with_needs(result: Result, context: RunContext) -> Result:
    """The result, with what the shot does not need among what is left out."""
    needs, accuracy = context.get(ModelChoices), result.accuracy
    if needs is None:
        return result
    if accuracy is not None:
        more = sum(row.estimated_error_m or 0.0 for row in needs.left_out)
        accuracy = replace(accuracy, left_out_m=accuracy.left_out_m + more)
    # a search tells more of its motors
    rows = needs.left_out if result.after is None else needs.left_out_but("motors")
    return replace(result, left_out=(*rows, *result.left_out), accuracy=accuracy)


def options_of(context: RunContext, **more: Any) -> Options:
    """What the user asked for, with what is forced of it."""
    needs = context.get(ModelChoices)
    if needs is not None:
        more |= {kind: needs.choice(kind) for kind in ("directions", "motors", "ranges")}
    return asked_options(context, **more)


def asked_options(context: RunContext, **more: Any) -> Options:
    """What the user asked for."""
    from calmotion.simulation.settings import Options

    source = context.get(Source)
    if source is None:
        return Options(**more)
    return Options(
        tolerance=source.tolerance,
        step=source.step,
        pre_roll=source.pre_roll,
        integrator=source.integrator,
        **more,
    )
