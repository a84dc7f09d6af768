"""Writes the mode shapes of flexible bodies: .vtu for ParaView, pictures, and a table."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import Operator, Property, RunContext, registration
from calmotion.model import (
    Character,
    FEMeshes,
    ModelChoices,
    ModeShapes,
    OutputPaths,
    Source,
    no_flexible_bodies,
    run_settings,
    simplified_character,
)
from calmotion.tolerance import ReducedBodies


class WriteModeShapes(Operator):
    """Mode shapes of every flexible body with their frequencies, damping and effective masses."""

    idname = "modes.write"
    label = "Write the mode shapes"
    requires = (Character, FEMeshes, OutputPaths)
    uses = (ReducedBodies, Source, ModelChoices)
    provides = (ModeShapes,)
    properties = (
        Property("dpi", int, 150, minimum=30, maximum=600, description="Resolution of the pictures, dots per inch."),
        Property("pictures", int, 8, minimum=1, maximum=30, description="Largest number of modes in one picture."),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        paths = data.get(OutputPaths)
        missing = None if paths and paths.modes else "no mode shapes are requested (--modes)"
        return no_flexible_bodies(data) or missing

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation import flexible_modes

        from .writing import write_modes

        meshes, reduced, source = context.get(FEMeshes), context.get(ReducedBodies), context.get(Source)
        character = simplified_character(context.get(Character), context.get(ModelChoices))
        loads = None if reduced is None or reduced.reduction is None else reduced.reduction.loads
        written = write_modes(
            context.get(OutputPaths).modes or "",
            flexible_modes(character, meshes, loads, run_settings(source).tolerance),
            total=len(meshes.meshes),
            dpi=context.properties.dpi,
            pictures=context.properties.pictures,
            progress=context.progress,
        )
        return (ModeShapes(tuple(written)),)


register, unregister = registration(WriteModeShapes)
