"""Shots from USD."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from calmotion.host import Operator, OutputPaths, RunContext, Source
from calmotion.shot import Animation, Character, Provenance


class ReadShot(Operator):
    """Reads a shot, and refuses what cannot be processed before anything costly starts."""

    idname = "usd.read"
    label = "Read the shot"
    requires = (Source,)
    uses = (OutputPaths,)
    provides = (Character, Animation, Provenance)

    def execute(self, context: RunContext) -> Sequence[object]:
        """The character, its animation, and what a writer must know."""
        # pxr loads in a third of a second: only when a shot is read
        from calmotion.usd.reading import read_shot
        from calmotion.usd.writing import refuse_inputs

        character, animation, provenance = read_shot(context.get(Source).path)
        outputs = context.get(OutputPaths)
        if outputs is not None and outputs.layer:
            refuse_inputs(provenance, outputs.layer)
        for note in character.notes:
            context.report("info", note)
        return character, animation, provenance


def register(host: Any) -> None:
    """Register the operator."""
    host.register_operator(ReadShot)


def unregister(host: Any) -> None:
    """Undo `register`."""
    host.unregister_operator(ReadShot)
