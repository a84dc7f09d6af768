"""Flexible bodies in few coordinates, and the natural frequencies of the character."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.accuracy.reduced_bodies import ConvergedReduction, ReducedBodies, compiled_in
from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.shot import Animation, Character, FEMeshes, ModelChoices
from calmotion.shot.model_choice import no_flexible_bodies, run_settings, simplified_character
from calmotion.shot.outputs import SystemModes
from calmotion.shot.run import OutputPaths, Source
from calmotion.simulation.compiled_shot import CompiledShot


class ReduceFlexibleBodies(Operator):
    """Reduces the finite elements of every flexible body to Craig-Bampton modes."""

    idname = "fem.reduce"
    label = "Reduce flexible bodies"
    requires = (Character,)
    uses = (FEMeshes, Animation, Source, ModelChoices)
    provides = (ReducedBodies,)
    checks = (Character, ModelChoices)
    properties = (
        Property(
            "elasticity",
            str,
            "shot",
            choices=("shot", "auto", "linear", "stvk", "neohookean"),
            description="Elastic law of every flexible body; shot: as calm:flexible:elasticity says",
        ),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        return no_flexible_bodies(data)

    def check(self, context: RunContext) -> None:
        from calmotion.reduction.interfaces.far_frames import refuse_far_frames

        refuse_far_frames(simplified_character(context.get(Character), context.get(ModelChoices)))

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation.bodies import mode_tables, with_elasticity
        from calmotion.simulation.body_reduction import BodyReduction, reduction_for

        choices, meshes, animation = context.get(ModelChoices), context.get(FEMeshes), context.get(Animation)
        character, source = simplified_character(context.get(Character), choices), context.get(Source)
        if context.properties.elasticity != "shot":
            character = with_elasticity(character, context.properties.elasticity)
        reduction, tolerance = BodyReduction(character, meshes, None), None
        if animation is not None and source is not None:
            context.progress(0.0, "loading kernels (compiled in the first run)")
            options = run_settings(source, choices)
            tolerance = options.tolerance
            reduction = reduction_for(character, animation, meshes, options, source.refines)
        bodies = tuple(reduction.bodies(tolerance, progress=context.progress))
        return [ReducedBodies(bodies, mode_tables(bodies), reduction)]


class CompileShot(Operator):
    """Makes one multibody system of the character and its bodies, compiled when it is first used."""

    idname = "dynamics.compile"
    label = "Prepare the multibody system"
    requires = (Character, Animation)
    uses = (ReducedBodies, ModelChoices)
    provides = (CompiledShot,)

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation.compiled_shot import compile_shot

        reduced = context.get(ReducedBodies)
        character = simplified_character(context.get(Character), context.get(ModelChoices))
        return [compile_shot(character, context.get(Animation), None if reduced is None else reduced.bodies)]


class FindSystemModes(Operator):
    """Natural modes of the whole character in its first pose."""

    idname = "dynamics.modes"
    label = "Compute the natural frequencies"
    requires = (Character, CompiledShot)
    uses = (ConvergedReduction, Source, OutputPaths, ModelChoices, Animation)
    provides = (SystemModes,)
    checks = (Character, Animation, ModelChoices)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source, paths = data.get(Source), data.get(OutputPaths)
        if source is not None and source.command != "inspect" and paths is not None:
            if not paths.figures and not paths.rrd:
                return NotAsked("only figures and recordings show frequencies, and none are requested")
        return no_flexible_bodies(data)

    def check(self, context: RunContext) -> None:
        from calmotion.shot.run import RunSettings
        from calmotion.simulation.inputs.supported import refuse_unsupported

        refuse_unsupported(context.get(Character), context.get(Animation), RunSettings(pre_roll=0.0))

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation.prepare import first_pose_modes

        context.progress(0.0, "loading kernels (compiled in the first run)")
        return [SystemModes(*first_pose_modes(compiled_in(context.get)))]


register, unregister = registration(ReduceFlexibleBodies, CompileShot, FindSystemModes)
