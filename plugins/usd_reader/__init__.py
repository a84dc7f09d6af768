"""Shots from USD."""

from collections.abc import Sequence

from calmotion.host import Operator, RunContext, registration
from calmotion.model import Animation, Character, Findings, MotorTracks, OutputPaths, Provenance, Source


class ReadShot(Operator):
    """Reads a shot, and refuses a wrong one before costly steps start."""

    idname = "usd.read"
    label = "Read the shot"
    requires = (Source,)
    uses = (OutputPaths, MotorTracks)
    provides = (Character, Animation, Provenance)

    def execute(self, context: RunContext) -> Sequence[object]:
        """The character, its animation and its provenance."""
        # pxr loads in a third of a second: only when a shot is read
        from calmotion.model import with_ideal_motors
        from calmotion.usd import read_shot, refuse_inputs

        source = context.get(Source)
        # `inspect` accepts a robot without animation
        character, animation, provenance = read_shot(
            source.path, still=source.command == "inspect", given=context.get(MotorTracks), measured=source.measured
        )
        outputs = context.get(OutputPaths)
        if outputs is not None and outputs.layer:
            refuse_inputs(provenance, outputs.layer)
        if source.settings.ideal_motors:
            character = with_ideal_motors(character)
        for note in character.notes:
            context.report("info", note)
        return character, animation, provenance


class ValidateShot(Operator):
    """Lists all errors and warnings about a shot, by Calmotion's rules and USD's validators."""

    idname = "usd.validate"
    label = "Check the shot"
    requires = (Source,)
    provides = (Findings,)

    def execute(self, context: RunContext) -> Sequence[object]:
        """The findings."""
        from calmotion.usd import validate_shot

        return (validate_shot(context.get(Source).path),)


register, unregister = registration(ReadShot, ValidateShot)
