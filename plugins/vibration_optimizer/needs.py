"""The operator `needs.analyse`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.accuracy.reduced_bodies import ReducedBodies
from calmotion.host import NotAsked, Operator, Property, RunContext
from calmotion.shot import Animation, Character, ModelChoices
from calmotion.shot.model_choice import AUTO, KINDS, OFF, ON, nothing_bends
from calmotion.shot.outputs import PlannedStep
from calmotion.shot.run import OutputPaths, Source

from .inputs import asked_options, inputs, options_of

_FORCED = {
    "bodies": "Finite elements of all flexible bodies, or of none",
    "turning": "Inertia terms of turning for all bodies, or for none",
    "loops": "All joints that close loops, or only those that rigid bodies need",
    "modes": "As many modes as if the tolerance were a thousandth, or only those that the motion excites",
    "elasticity": "Nonlinear elasticity of all flexible bodies, or linear",
    "motors": "All motors that may change, or only those that move a target, without looking back",
    "directions": "All elastic coordinates of nonlinear bodies and pairs of them, or the fewest that do for the shot",
    "ranges": "All of the shot, or only where a change promises to help, without looking back",
}


class AnalyseNeeds(Operator):
    """What the shot needs of bodies, terms, loops, motors: decided before meshes and finite elements."""

    idname = "needs.analyse"
    label = "Find out what the shot needs"
    requires = (Character, Animation)
    uses = (Source, OutputPaths)
    provides = (ModelChoices,)
    properties = tuple(
        Property(kind, str, AUTO, choices=(AUTO, ON, OFF), description=f"{_FORCED[kind]}; auto: by the tolerance")
        for kind in KINDS
    )

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.accuracy.simplification.analysis import analyse

        source, paths = context.get(Source), context.get(OutputPaths)
        forced = {kind: getattr(context.properties, kind) for kind in KINDS}
        if paths is not None and paths.modes and forced["bodies"] == AUTO:
            forced["bodies"] = ON  # their mode shapes are asked for
        changes = source is None or source.command != "simulate"
        options = asked_options(context)
        return [analyse(context.get(Character), context.get(Animation), options, forced, changes)]


class PlanStep(Operator):
    """The time step that the shot as animated would be simulated with, and its error at the targets."""

    idname = "needs.step"
    label = "Find out which time step the shot needs"
    requires = (Character, Animation)
    uses = (ReducedBodies, ModelChoices, Source)
    provides = (PlannedStep,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source, character = data.get(Source), data.get(Character)
        if source is not None and source.command != "inspect":
            return NotAsked("other commands take it")
        reason = nothing_bends(data)
        if reason is None or character is None:
            return None
        driven = {motor.joint for motor in character.motors}
        free = any(k not in driven and joint.kind != "fixed" for k, joint in enumerate(character.joints))
        return None if free else f"{reason}, and motors alone decide where it is"

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.accuracy.simulate_to_tolerance import planned_step

        context.progress(0.0, "simulating the shot as animated")
        return [PlannedStep(planned_step(*inputs(context), options_of(context)))]
