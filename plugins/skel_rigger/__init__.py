"""Robots from skinned characters and animated parts."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.catalogs import MATERIALS
from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.model import OutputPaths, Rig, Source


class RigSkeleton(Operator):
    """Bodies cut from the skin by its weights, or animated parts; the fewest hinges that follow each, masses of a
    material."""

    idname = "rig.skeleton"
    label = "Make a robot from the animation"
    requires = (Source, OutputPaths)
    provides = (Rig,)
    properties = (
        Property("material", str, "nylon", choices=tuple(MATERIALS), description="Material of the links"),
        Property(
            "angle_tolerance",
            float,
            0.05,
            unit="deg",
            minimum=0.0,
            maximum=45.0,
            description="Largest residual angle between a joint and its hinges; a larger one needs fewer hinges",
        ),
        Property(
            "servo_share",
            float,
            0.05,
            minimum=1e-4,
            maximum=10.0,
            description="Mass of a servo between two hinges, relative to the link that they rotate",
        ),
        Property("flexible", str, "none", description="Flexible links: all, none, or names separated by commas"),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        return None if data[Source].command == "rig" else NotAsked("only `calmotion rig` makes a robot")

    def execute(self, context: RunContext) -> Sequence[object]:
        """The robot."""
        import numpy as np
        from calmotion.usd import RigOptions, rig_shot

        values, output = context.properties, context.get(OutputPaths).layer
        assert output is not None  # the command line requires it
        names = [] if values.flexible == "none" else [name.strip() for name in values.flexible.split(",")]
        options = RigOptions(
            material=values.material,
            angle_tolerance=float(np.radians(values.angle_tolerance)),
            servo_share=values.servo_share,
            flexible=tuple(filter(None, names)),
        )
        return (rig_shot(context.get(Source).path, output, options),)


register, unregister = registration(RigSkeleton)
