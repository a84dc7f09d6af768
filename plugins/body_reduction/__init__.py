"""Flexible bodies in few coordinates, and the natural frequencies of the character."""

import contextlib
from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.errors import ShotError
from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.model import (
    Animation,
    Character,
    FEMeshes,
    ModelChoices,
    OutputPaths,
    Result,
    Source,
    SystemModes,
    motors_give,
    no_flexible_bodies,
    run_settings,
    simplified_character,
)
from calmotion.simulation import CompiledShot
from calmotion.tolerance import ConvergedReduction, ReducedBodies, compiled_in


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
        from calmotion.mesh import refuse_named_surfaces
        from calmotion.reduction import refuse_soft_bodies

        character = simplified_character(context.get(Character), context.get(ModelChoices))
        refuse_named_surfaces(character)
        refuse_soft_bodies(character)

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.mesh import contact_notes
        from calmotion.simulation import (
            BodyReduction,
            estimated_bodies,
            mode_tables,
            reduction_for,
            weak_seat_notes,
            with_elasticity,
        )

        choices, meshes, animation = context.get(ModelChoices), context.get(FEMeshes), context.get(Animation)
        character, source = simplified_character(context.get(Character), choices), context.get(Source)
        if context.properties.elasticity != "shot":
            character = with_elasticity(character, context.properties.elasticity)
        if source is not None and source.by_sections:
            beams, tables = estimated_bodies(character, context.progress)
            return [ReducedBodies(tuple(beams), tables)]
        for note in contact_notes(character, meshes) if meshes is not None else ():
            context.report("info", note)
        reduction, tolerance = BodyReduction(character, meshes, None), None
        if animation is not None and source is not None:
            context.progress(0.0, "loading kernels (compiled in the first run)")
            options = run_settings(source, choices)
            tolerance = options.tolerance
            reduction = reduction_for(character, animation, meshes, options, source.refines)
        bodies = tuple(reduction.bodies(tolerance, progress=context.progress))
        for note in weak_seat_notes(character, meshes, bodies) if meshes is not None else ():
            context.report("info", note)
        return [ReducedBodies(bodies, mode_tables(bodies), reduction)]


class CompileShot(Operator):
    """Makes one multibody system of the character and its bodies, compiled when it is first used."""

    idname = "dynamics.compile"
    label = "Prepare the multibody system"
    requires = (Character, Animation)
    uses = (ReducedBodies, ModelChoices)
    provides = (CompiledShot,)

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation import compile_shot

        reduced = context.get(ReducedBodies)
        character = simplified_character(context.get(Character), context.get(ModelChoices))
        return [compile_shot(character, context.get(Animation), None if reduced is None else reduced.bodies)]


class FindSystemModes(Operator):
    """Natural modes of the whole character: where it shakes most after a simulation, else in its first pose."""

    idname = "dynamics.modes"
    label = "Compute the natural frequencies"
    requires = (Character, CompiledShot)
    uses = (ConvergedReduction, Source, OutputPaths, ModelChoices, Animation, Result)
    provides = (SystemModes,)
    checks = (Character, Animation, ModelChoices)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source, paths = data.get(Source), data.get(OutputPaths)
        if source is not None and source.command != "inspect" and paths is not None:
            if not (paths.figures or paths.rrd or paths.html):
                return NotAsked("only figures, recordings and pages show frequencies, and none are requested")
        character = data.get(Character)
        return None if character is not None and motors_give(character) else no_flexible_bodies(data)

    def check(self, context: RunContext) -> None:
        from calmotion.model import RunSettings
        from calmotion.simulation import refuse_unsupported

        refuse_unsupported(context.get(Character), context.get(Animation), RunSettings(pre_roll=0.0))

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation import pose_modes

        context.progress(0.0, "loading kernels (compiled in the first run)")
        shot, result = compiled_in(context.get), context.get(Result)
        time = 0.0 if result is None else result.before.time_of_largest_error
        if time > 0.0:
            with contextlib.suppress(ShotError):  # such as a pose that a closed chain reaches only from another one
                return [SystemModes(*pose_modes(shot, time), time)]
        return [SystemModes(*pose_modes(shot))]


register, unregister = registration(ReduceFlexibleBodies, CompileShot, FindSystemModes)
