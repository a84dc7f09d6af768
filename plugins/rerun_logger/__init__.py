"""Writes a result as a rerun recording (.rrd)."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import Operator, Property, RunContext, registration
from calmotion.model import Animation, Character, OutputPaths, Recording, Result, SystemModes


class LogRecording(Operator):
    """The character in 3D at the shot's frames, and errors, motor curves and progress as plots."""

    idname = "rerun.log"
    label = "Write the rerun recording"
    requires = (Character, Animation, Result, OutputPaths)
    uses = (SystemModes,)
    provides = (Recording,)
    properties = (
        Property(
            "samples_per_plot",
            int,
            2000,
            minimum=2,
            maximum=100000,
            description="Largest number of samples of a plotted curve; a longer one is thinned evenly.",
        ),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        paths = data.get(OutputPaths)
        return None if paths and paths.rrd else "no recording is requested (--rrd)"

    def execute(self, context: RunContext) -> Sequence[object]:
        from .recording import write_recording

        path, result = context.get(OutputPaths).rrd or "", context.get(Result)
        write_recording(
            path,
            context.get(Character),
            result.performed_animation(context.get(Animation)),
            result,
            samples_per_plot=context.properties.samples_per_plot,
            progress=context.progress,
            system=context.get(SystemModes),
        )
        return (Recording(path),)


register, unregister = registration(LogRecording)
