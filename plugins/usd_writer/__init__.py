"""Results into USD."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from calmotion.host import Operator, Property, RunContext, registration
from calmotion.model import Animation, Character, OutputPaths, Provenance, Result, Source, WrittenLayer

if TYPE_CHECKING:
    from calmotion.usd import WriteOptions

_PLACES = {"bodies": "the transforms of its bodies", "skeleton": "its skeleton"}  # of curves that no drive holds


class WriteResult(Operator):
    """Writes one layer of overs, and a root layer that opens it with the shot."""

    idname = "usd.write"
    label = "Write the layer"
    requires = (Character, Animation, Provenance, Result, OutputPaths)
    uses = (Source,)
    provides = (WrittenLayer,)
    checks = (Character, Animation, Source, OutputPaths)
    properties = (
        Property(
            "samples_per_second",
            float,
            None,
            unit="Hz",
            minimum=1e-3,
            description="Least density of the motor samples, for consumers that interpolate linearly; auto: frames.",
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
        Property(
            "retime_scene",
            bool,
            True,
            description="Cameras, props and sounds follow the tempo of a retimed performance, not the character alone.",
        ),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """Skipped where no layer is requested."""
        outputs = data.get(OutputPaths)
        return "no layer is requested (-o)" if outputs is not None and outputs.layer is None else None

    def check(self, context: RunContext) -> None:
        """Options that fit each other and the motors whose curves may change."""
        from calmotion.usd import motors_that_may_change, refuse_bake, refuse_foreign_root, refuse_options

        paths = context.get(OutputPaths)
        if paths is not None and paths.layer is not None:
            refuse_foreign_root(paths.layer)
        source, character, animation = context.get(Source), context.get(Character), context.get(Animation)
        searches = source is not None and source.command == "optimize"
        seconds = float(animation.frame_times[-1]) if len(animation.frame_times) else 0.0
        refuse_options(self._options(context), motors_that_may_change(character) if searches else (), seconds)
        if searches:
            refuse_bake(self._options(context), character.motors)

    def execute(self, context: RunContext) -> Sequence[object]:
        """The paths of both layers."""
        from calmotion.usd import motors_that_may_change, sampled_at_frames, write_result

        options, result = self._options(context), context.get(Result)
        for motor in sampled_at_frames(options, motors_that_may_change(context.get(Character)) if result.after else ()):
            context.report("info", f"{motor.path}: its curve is samples at the frames, of {_PLACES[motor.source]}")
        layer, root = write_result(
            context.get(Character),
            context.get(Animation),
            context.get(Provenance),
            result,
            str(context.get(OutputPaths).layer),
            options,
        )
        return (WrittenLayer(layer=layer, root=root),)

    @staticmethod
    def _options(context: RunContext) -> WriteOptions:
        from calmotion.usd import WriteOptions

        values = context.properties
        return WriteOptions(
            samples_per_second=values.samples_per_second,
            splines=values.splines,
            bake=values.bake,
            retime_scene=values.retime_scene,
        )


register, unregister = registration(WriteResult)
