"""Results into USD."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import Operator, Property, RunContext, registration
from calmotion.shot import Animation, Character, Provenance, Result
from calmotion.shot.outputs import WrittenLayer
from calmotion.shot.run import OutputPaths


class WriteResult(Operator):
    """Writes one layer of overs, and a root layer that opens it with the shot."""

    idname = "usd.write"
    label = "Write the layer"
    requires = (Character, Animation, Provenance, Result, OutputPaths)
    provides = (WrittenLayer,)
    properties = (
        Property(
            "samples_per_second",
            float,
            -1.0,
            unit="Hz",
            minimum=1e-3,
            description="Least density of the motor samples, for consumers that interpolate linearly; -1: the frames.",
        ),
        Property(
            "splines", bool, False, description="Motor curves as splines with the optimiser's knots, not samples."
        ),
        Property(
            "bake",
            str,
            "none",
            choices=("none", "motors", "simulated"),
            description="Also write body transforms, of a rigid robot with the new curves, or of the predicted motion "
            "with its deformed meshes.",
        ),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """Skipped where no layer is requested."""
        outputs = data.get(OutputPaths)
        return "no layer is requested (-o)" if outputs is not None and outputs.layer is None else None

    def execute(self, context: RunContext) -> Sequence[object]:
        """The paths of both layers."""
        from calmotion.usd.writing import WriteOptions, write_result

        values = context.properties
        rate = values.samples_per_second
        layer, root = write_result(
            context.get(Character),
            context.get(Animation),
            context.get(Provenance),
            context.get(Result),
            str(context.get(OutputPaths).layer),
            WriteOptions(samples_per_second=rate if rate > 0.0 else None, splines=values.splines, bake=values.bake),
        )
        context.report("info", f"open {root} to see {layer} together with the shot")
        return (WrittenLayer(layer=layer, root=root),)


register, unregister = registration(WriteResult)
