"""Reduce, simulate and retarget: hands a shot to the engine and its result back to the host."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from calmotion.accuracy.reduced_bodies import ReducedBodies
from calmotion.host import NotAsked, Operator, Property, RunContext
from calmotion.shot import Animation, Character, FEMeshes, ModelChoices, Result
from calmotion.shot.model_choice import nothing_bends
from calmotion.shot.outputs import ShapedTracks, SystemModes, Verification
from calmotion.shot.run import OutputPaths, Source

from .inputs import character_of, inputs, options_of, with_needs
from .needs import AnalyseNeeds, PlanStep


def _wrong_command(data: Mapping[type, Any], command: str) -> str | None:
    source = data.get(Source)
    return None if source is None or source.command == command else f"the command is {source.command}"


class ReduceFlexibleBodies(Operator):
    """Finite elements to Craig-Bampton modes, for every flexible body."""

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

        character, meshes, animation = character_of(context), context.get(FEMeshes), context.get(Animation)
        if context.properties.elasticity != "shot":
            character = with_elasticity(character, context.properties.elasticity)
        loads, tolerance, source = None, None, context.get(Source)
        if animation is not None and source is not None:
            context.progress(0.0, "compiling kernels, once")
            options = options_of(context)
            if source.command != "inspect" and source.tolerance is not None:
                from calmotion.accuracy.converged_reduction import converged_reduction

                search = source.command == "optimize"
                settled = converged_reduction(
                    character, animation, meshes, options, context.progress, retargeted=search
                )
                error = None if search else settled.error_m
                return [ReducedBodies(settled.bodies, mode_tables(settled.bodies), error, settled.known)]
            loads, tolerance = load_envelopes(character, animation, meshes, options), options.tolerance
        bodies = reduce_bodies(character, span_tree(character), meshes, context.progress, loads, tolerance)
        return [ReducedBodies(tuple(bodies), mode_tables(bodies))]


class FindSystemModes(Operator):
    """Natural modes of the whole character in its first pose."""

    idname = "dynamics.modes"
    label = "Find the frequencies of the character"
    requires = (Character, Animation)
    uses = (ReducedBodies, Source, OutputPaths, ModelChoices)
    provides = (SystemModes,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source, paths = data.get(Source), data.get(OutputPaths)
        if source is not None and source.command != "inspect" and paths is not None:
            if not paths.figures and not paths.rrd:
                return NotAsked("only figures and recordings show frequencies, and none are asked for")
        return nothing_bends(data)

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation.prepare import first_pose_modes

        context.progress(0.0, "compiling kernels, once")
        return [SystemModes(*first_pose_modes(*inputs(context)))]


class ShapeTracks(Operator):
    """What practitioners do otherwise: the motors' tracks through an input shaper or a low-pass filter."""

    idname = "retarget.shape"
    label = "Shape the motors' tracks"
    requires = (Character, Animation, Source)
    uses = (ReducedBodies, ModelChoices)
    provides = (ShapedTracks,)
    properties = (
        Property("cutoff", float, 0.5, minimum=0.01, description="Of the low-pass filter, over the lowest frequency"),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source = data.get(Source)
        return NotAsked("no --shaper was asked for") if source is None or not source.shaper else None

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation.simulate import shape_tracks

        kind, cutoff = context.get(Source).shaper or "", context.properties.cutoff
        return [ShapedTracks(shape_tracks(*inputs(context), options_of(context), kind, cutoff))]


class SimulateShot(Operator):
    """The shot as animated, on the flexible robot."""

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

        character, animation, bodies = inputs(context)
        shaped = context.get(ShapedTracks)
        if shaped is not None:
            animation = replace(animation, current=shaped.tracks)
        reduced = context.get(ReducedBodies)
        error, known = (None, None) if reduced is None else (reduced.error_m, reduced.known)
        result = simulate_to_tolerance(
            character, animation, bodies, options_of(context), context.progress, error, known
        )
        return [with_needs(result, context)]


class OptimizeShot(Operator):
    """The motor curves that make the flexible robot move as animated."""

    idname = "retarget.optimize"
    label = "Optimise the motor curves"
    requires = (Character, Animation, Source)
    uses = (ReducedBodies, OutputPaths, ModelChoices)
    provides = (Result,)
    properties = (
        Property("max_iterations", int, 30, minimum=1, description="Most Gauss-Newton iterations"),
        Property(
            "knot_spacing",
            float,
            -1.0,
            unit="s",
            description="Distance of the spline's knots, -1: the shot's, or where its motion needs them",
        ),
        Property("smoothness", float, -1.0, description="Weight of the offsets' second derivative, -1: the shot's"),
        Property(
            "adjoint",
            str,
            "discrete",
            choices=("discrete", "continuous"),
            description="Where gradients come from; the continuous one is not exact, and knows nothing of efforts",
        ),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        return _wrong_command(data, "optimize")

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.retargeting.checkpoint import checkpoint_path
        from calmotion.retargeting.to_tolerance import optimize_to_tolerance

        values = context.properties
        options = options_of(
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
        result = optimize_to_tolerance(*inputs(context), options, context.progress, kept, known)
        if result.interrupted:
            context.report(
                "warning", "interrupted: these are the best curves so far; the same command goes on from them"
            )
        return [with_needs(result, context)]


class VerifyResult(Operator):
    """The result against a finer run of the same curves: a quarter of the step, a tenth of what the modes leave out."""

    idname = "retarget.verify"
    label = "Compare with a finer run"
    requires = (Character, Animation, Source, Result)
    uses = (FEMeshes, ReducedBodies, ShapedTracks, ModelChoices)
    provides = (Verification,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source = data.get(Source)
        return NotAsked("no --verify was asked for") if source is None or not source.verify else None

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.accuracy.verify import verify

        animation, shaped = context.get(Animation), context.get(ShapedTracks)
        if shaped is not None:
            animation = replace(animation, current=shaped.tracks)
        character, _, bodies = inputs(context)
        meshes, result, options = context.get(FEMeshes), context.get(Result), options_of(context)
        return [Verification(*verify(character, animation, meshes, bodies, result, options, context.progress))]


OPERATORS = (
    AnalyseNeeds,
    PlanStep,
    ReduceFlexibleBodies,
    FindSystemModes,
    ShapeTracks,
    SimulateShot,
    OptimizeShot,
    VerifyResult,
)


def register(host: Any) -> None:
    """Register the operators."""
    for operator in OPERATORS:
        host.register_operator(operator)


def unregister(host: Any) -> None:
    """Undo `register`."""
    for operator in reversed(OPERATORS):
        host.unregister_operator(operator)
