"""Simulates and retargets shots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from calmotion.accuracy.reduced_bodies import ReducedBodies
from calmotion.host import NotAsked, Operator, Property, RunContext
from calmotion.shot import Animation, Character, ModelChoices, Result
from calmotion.shot.model_choice import simplified_character, with_choices
from calmotion.shot.outputs import ShapedTracks
from calmotion.shot.run import OutputPaths, Source


def _inputs(context: RunContext) -> tuple[Character, Animation, Sequence[Any] | None]:
    """Character, animation and reduced bodies, with the simplifications of the model."""
    reduced = context.get(ReducedBodies)
    character = simplified_character(context.get(Character), context.get(ModelChoices))
    return character, context.get(Animation), None if reduced is None else reduced.bodies


def _options(context: RunContext, **more: Any) -> Any:
    """The user's request, with what the user forced of the model."""
    from calmotion.simulation.settings import requested_options

    return requested_options(context.get(Source), context.get(ModelChoices), **more)


def _wrong_command(data: Mapping[type, Any], command: str) -> str | None:
    source = data.get(Source)
    return None if source is None or source.command == command else f"the command is {source.command}"


class ShapeTracks(Operator):
    """Filters the tracks of the motors with an input shaper or a low-pass filter, to compare with."""

    idname = "retarget.shape"
    label = "Filter the tracks of the motors"
    requires = (Character, Animation, Source)
    uses = (ReducedBodies, ModelChoices)
    provides = (ShapedTracks,)
    properties = (
        Property(
            "cutoff",
            float,
            0.5,
            minimum=0.01,
            description="Cutoff of the low-pass filter, over the lowest natural frequency",
        ),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source = data.get(Source)
        return NotAsked("no --shaper is requested") if source is None or not source.shaper else None

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation.simulate import shape_tracks

        kind, cutoff = context.get(Source).shaper or "", context.properties.cutoff
        return [ShapedTracks(shape_tracks(*_inputs(context), _options(context), kind, cutoff))]


class SimulateShot(Operator):
    """Simulates the shot as animated on the flexible robot."""

    idname = "retarget.simulate"
    label = "Simulate the shot"
    requires = (Character, Animation, Source)
    uses = (ReducedBodies, ShapedTracks, ModelChoices)
    provides = (Result,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        return _wrong_command(data, "simulate")

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.accuracy.simulate_to_tolerance import simulate_to_tolerance

        character, animation, bodies = _inputs(context)
        shaped = context.get(ShapedTracks)
        if shaped is not None:
            animation = replace(animation, current=shaped.tracks)
        reduced = context.get(ReducedBodies)
        error, known = (None, None) if reduced is None else (reduced.error_m, reduced.known)
        result = simulate_to_tolerance(character, animation, bodies, _options(context), context.progress, error, known)
        return [with_choices(result, context.get(ModelChoices))]


class OptimizeShot(Operator):
    """Finds motor curves with which the flexible robot performs the intended motion."""

    idname = "retarget.optimize"
    label = "Optimise the motor curves"
    requires = (Character, Animation, Source)
    uses = (ReducedBodies, OutputPaths, ModelChoices)
    provides = (Result,)
    properties = (
        Property("max_iterations", int, 30, minimum=1, description="Largest number of Gauss-Newton iterations"),
        Property(
            "knot_spacing",
            float,
            -1.0,
            unit="s",
            description="Distance of the knots; -1: that of the shot, or adaptive",
        ),
        Property(
            "smoothness",
            float,
            -1.0,
            description="Weight of the second derivative of the offsets; -1: that of the shot",
        ),
        Property(
            "adjoint",
            str,
            "discrete",
            choices=("discrete", "continuous"),
            description="Source of the gradients; the continuous adjoint is not exact and has no limits of effort",
        ),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        return _wrong_command(data, "optimize")

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.retargeting.checkpoint import checkpoint_path
        from calmotion.retargeting.to_tolerance import optimize_to_tolerance

        values = context.properties
        options = _options(
            context,
            max_iterations=values.max_iterations,
            knot_spacing=values.knot_spacing if values.knot_spacing > 0.0 else None,
            smoothness=values.smoothness if values.smoothness >= 0.0 else None,
            adjoint=values.adjoint,
        )
        paths = context.get(OutputPaths)
        kept = checkpoint_path(paths.layer) if paths is not None and paths.layer else None
        reduced = context.get(ReducedBodies)
        known = None if reduced is None else reduced.known
        result = optimize_to_tolerance(*_inputs(context), options, context.progress, kept, known)
        if result.interrupted:
            context.report(
                "warning", "interrupted: these are the best curves so far; the same command resumes from them"
            )
        return [with_choices(result, context.get(ModelChoices))]


OPERATORS = (ShapeTracks, SimulateShot, OptimizeShot)


def register(host: Any) -> None:
    """Register the operators."""
    for operator in OPERATORS:
        host.register_operator(operator)


def unregister(host: Any) -> None:
    """Undo `register`."""
    for operator in reversed(OPERATORS):
        host.unregister_operator(operator)
