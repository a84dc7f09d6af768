"""Flexible bodies in few coordinates, and the natural frequencies of the character."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.accuracy.reduced_bodies import ReducedBodies
from calmotion.host import NotAsked, Operator, Property, RunContext
from calmotion.shot import Animation, Character, FEMeshes, ModelChoices
from calmotion.shot.model_choice import nothing_bends, simplified_character
from calmotion.shot.outputs import SystemModes
from calmotion.shot.run import OutputPaths, Source


class ReduceFlexibleBodies(Operator):
    """Reduces the finite elements of every flexible body to Craig-Bampton modes."""

    idname = "fem.reduce"
    label = "Reduce flexible bodies"
    requires = (Character,)
    uses = (FEMeshes, Animation, Source, ModelChoices)
    provides = (ReducedBodies,)
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
        return nothing_bends(data)

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.multibody.model.topology import span_tree
        from calmotion.simulation.bodies import mode_tables, reduce_bodies, with_elasticity
        from calmotion.simulation.prepare import load_envelopes
        from calmotion.simulation.settings import requested_options

        choices, meshes, animation = context.get(ModelChoices), context.get(FEMeshes), context.get(Animation)
        character = simplified_character(context.get(Character), choices)
        if context.properties.elasticity != "shot":
            character = with_elasticity(character, context.properties.elasticity)
        loads, tolerance, source = None, None, context.get(Source)
        if animation is not None and source is not None:
            context.progress(0.0, "loading kernels (compiled in the first run)")
            options = requested_options(source, choices)
            if source.command != "inspect" and source.tolerance is not None:
                from calmotion.accuracy.converged_reduction import converged_reduction

                search = source.command == "optimize"
                converged = converged_reduction(
                    character, animation, meshes, options, context.progress, retargeted=search
                )
                error = None if search else converged.error_m
                return [ReducedBodies(converged.bodies, mode_tables(converged.bodies), error, converged.known)]
            loads, tolerance = load_envelopes(character, animation, meshes, options), options.tolerance
        bodies = reduce_bodies(character, span_tree(character), meshes, context.progress, loads, tolerance)
        return [ReducedBodies(tuple(bodies), mode_tables(bodies))]


class FindSystemModes(Operator):
    """Natural modes of the whole character in its first pose."""

    idname = "dynamics.modes"
    label = "Compute the natural frequencies"
    requires = (Character, Animation)
    uses = (ReducedBodies, Source, OutputPaths, ModelChoices)
    provides = (SystemModes,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source, paths = data.get(Source), data.get(OutputPaths)
        if source is not None and source.command != "inspect" and paths is not None:
            if not paths.figures and not paths.rrd:
                return NotAsked("only figures and recordings show frequencies, and none are requested")
        return nothing_bends(data)

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation.prepare import first_pose_modes

        context.progress(0.0, "loading kernels (compiled in the first run)")
        reduced = context.get(ReducedBodies)
        character = simplified_character(context.get(Character), context.get(ModelChoices))
        bodies = None if reduced is None else reduced.bodies
        return [SystemModes(*first_pose_modes(character, context.get(Animation), bodies))]


OPERATORS = (ReduceFlexibleBodies, FindSystemModes)


def register(host: Any) -> None:
    """Register the operators."""
    for operator in OPERATORS:
        host.register_operator(operator)


def unregister(host: Any) -> None:
    """Undo `register`."""
    for operator in reversed(OPERATORS):
        host.unregister_operator(operator)
