"""Error control: simplifications of the model, the time step, and the measured error of a result."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.model import (
    AUTO,
    KINDS,
    LONG_SHOT,
    OFF,
    ON,
    PRESCRIBED,
    Animation,
    Character,
    ExceededLimits,
    ModelChoices,
    MotorEffects,
    OutputPaths,
    PlannedStep,
    Result,
    ShapedTracks,
    Source,
    Verification,
    has_limits,
    no_flexible_bodies,
    run_settings,
)
from calmotion.simulation import CompiledShot
from calmotion.tolerance import ConvergedReduction, ReducedBodies, compiled_in

_FORCED = {
    "bodies": "Finite elements of all flexible bodies, or of none",
    "turning": "Gyroscopic terms of all bodies, or of none",
    "loops": "All joints that close chains, or only those that are not redundant",
    "modes": "As many modes as for a thousandth of the tolerance, or only those that the motion excites",
    "elasticity": "Nonlinear elasticity of all flexible bodies, or linear",
    "motors": "All motors that may change, or only those that move a target, without a check at the end",
    "directions": "All elastic coordinates of nonlinear bodies and all pairs of them, or the smallest subspaces",
}
_AUTO = {"bodies": "of all"}  # of the others: by the tolerance


class AnalyseShot(Operator):
    """Decides on the simplifications of the model, before meshes and finite elements are made."""

    idname = "accuracy.analyse"
    label = "Analyse the shot"
    requires = (Character, Animation)
    uses = (Source, OutputPaths)
    provides = (ModelChoices,)
    properties = (
        *(
            Property(
                kind, str, AUTO, choices=(AUTO, ON, OFF),
                description=f"{_FORCED[kind]}; auto: {_AUTO.get(kind, 'by the tolerance')}",
            )
            for kind in KINDS
        ),
        Property(
            "max_hours", float, 24.0, minimum=0.0,
            description="Largest estimated processor time of a run [h]; a shot that needs more is refused",
        ),
    )  # fmt: skip

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.support import available_memory
        from calmotion.tolerance import analyse, expected_cost, refuse_unaffordable

        source, paths = context.get(Source), context.get(OutputPaths)
        forced = {kind: getattr(context.properties, kind) for kind in KINDS}
        if paths is not None and paths.modes and forced["bodies"] == AUTO:
            forced["bodies"] = ON  # their mode shapes are requested
        changes = source is None or source.command != "simulate"
        options, character, animation = run_settings(source), context.get(Character), context.get(Animation)
        if source is not None:
            cost = expected_cost(character, animation, options, source.command == "optimize")
            refuse_unaffordable(cost, character.path, context.properties.max_hours, available_memory())
        choices = analyse(character, animation, options, forced, changes)
        if source is not None and source.command == "inspect":  # reports of the others tell them with their errors
            for note in choices.notes:
                context.report("info", note)
        return [choices]


class RefineReduction(Operator):
    """Refines the reduction of the bodies until the shot as animated keeps the tolerance."""

    idname = "accuracy.refine"
    label = "Refine the reduction"
    requires = (ReducedBodies, CompiledShot, Source)
    uses = (ModelChoices,)
    provides = (ConvergedReduction,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source, reduced = data.get(Source), data.get(ReducedBodies)
        if source is None or not source.refines:
            return NotAsked("the shot is only inspected")
        return "its plugin cannot repeat the reduction" if reduced is not None and reduced.reduction is None else None

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.tolerance import converged_reduction

        source, reduction = context.get(Source), context.get(ReducedBodies).reduction
        assert reduction is not None
        options = run_settings(source, context.get(ModelChoices))
        retargeted = source.command == "optimize"
        shot = context.get(CompiledShot)
        return [converged_reduction(shot, reduction, options, context.progress, retargeted=retargeted)]


class PlanStep(Operator):
    """The time step with which the shot as animated would be simulated, and its error at the targets."""

    idname = "accuracy.step"
    label = "Choose the time step"
    requires = (Character, CompiledShot)
    uses = (ModelChoices, Source, Animation)
    provides = (PlannedStep,)
    checks = (Character, Animation, Source, ModelChoices)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source, character, animation = data.get(Source), data.get(Character), data.get(Animation)
        if source is not None and source.command != "inspect":
            return NotAsked("other commands choose it themselves")
        if animation is not None and len(animation.frame_times) < 2:
            return "the shot has one frame, and so no motion"
        reason = no_flexible_bodies(data)
        if reason is None or character is None:
            return None
        driven = {motor.joint for motor in character.motors if motor.model == PRESCRIBED}
        free = any(k not in driven and joint.kind != "fixed" for k, joint in enumerate(character.joints))
        return None if free else f"{reason}, and motors alone determine the motion"

    def check(self, context: RunContext) -> None:
        from calmotion.tolerance import check_simulation

        check_simulation(context.get(Character), context.get(Animation), run_settings(context.get(Source)))

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.tolerance import planned_step

        context.progress(0.0, "simulating the shot as animated")
        options = run_settings(context.get(Source), context.get(ModelChoices))
        return [PlannedStep(planned_step(_representative(context), options))]


def _representative(context: RunContext) -> CompiledShot:
    """The shot, or of a long one its busiest part: `inspect` tells beforehand, and is not to take as long as a run."""
    from calmotion.simulation import busiest

    shot: CompiledShot = context.get(CompiledShot)
    part = busiest(shot.character, shot.animation, LONG_SHOT)
    if part is shot.animation:
        return shot
    context.report("info", f"the shot is long: only its busiest {LONG_SHOT:g} s are simulated")
    return replace(shot, animation=part)


class EstimateMotorEffects(Operator):
    """How far the motors would move the targets if they gave by the gains in the shot."""

    idname = "accuracy.motors"
    label = "Simulate the gains of the motors"
    requires = (Character, CompiledShot)
    uses = (ModelChoices, Source, Animation)
    provides = (MotorEffects,)
    checks = (Character, Animation, Source, ModelChoices)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source, character = data.get(Source), data.get(Character)
        if source is not None and source.command != "inspect":
            return NotAsked("other commands simulate the motors as their models say")
        if source is not None and source.settings.ideal_motors:
            return NotAsked("--motors ideal is requested")
        if character is not None and not any(motor.position_gain > 0.0 for motor in character.motors):
            return NotAsked("no motor has gains")
        animation = data.get(Animation)
        if animation is not None and len(animation.frame_times) < 2:
            return NotAsked("the shot has a single frame")
        return None

    def check(self, context: RunContext) -> None:
        from calmotion.tolerance import check_simulation

        check_simulation(context.get(Character), context.get(Animation), run_settings(context.get(Source)))

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.tolerance import effects_of_gains

        context.progress(0.0, "simulating the robot on compliant motors")
        options = run_settings(context.get(Source), context.get(ModelChoices))
        found = effects_of_gains(_representative(context), options)
        if not found.motors:
            context.report("warning", "with the gains in the shot, its motors could not hold the robot")
        return [found]


class CompareWithLimits(Operator):
    """Which limits of the motors the animation exceeds, on a rigid robot with ideal motors."""

    idname = "accuracy.limits"
    label = "Compare the animation with the limits"
    requires = (Character, Animation)
    uses = (Source,)
    provides = (ExceededLimits,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source, character, animation = data.get(Source), data.get(Character), data.get(Animation)
        if source is not None and source.command not in ("inspect", "check"):
            return NotAsked("other commands report it for their simulation")
        if character is not None and not has_limits(character):
            return NotAsked("no motor has limits")
        if animation is not None and len(animation.frame_times) < 2:
            return NotAsked("the shot has a single frame")
        return None

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.simulation import busiest
        from calmotion.tolerance import exceeded_limits

        character = context.get(Character)
        part = busiest(character, context.get(Animation), LONG_SHOT)
        return [exceeded_limits(character, part, run_settings(context.get(Source)))]


class VerifyResult(Operator):
    """Compares the result with a finer run of the same curves, with a quarter of the step and more modes."""

    idname = "retarget.verify"
    label = "Compare with a finer run"
    requires = (CompiledShot, Source, Result)
    uses = (ReducedBodies, ConvergedReduction, ShapedTracks, ModelChoices)
    provides = (Verification,)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        source = data.get(Source)
        return NotAsked("no --verify is requested") if source is None or not source.verify else None

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.tolerance import verify

        result, shaped, reduced = context.get(Result), context.get(ShapedTracks), context.get(ReducedBodies)
        shot = compiled_in(context.get).at(result.retimed)
        if shaped is not None:
            shot = shot.with_tracks(shaped.tracks)
        converged = context.get(ConvergedReduction)
        reduction = None if reduced is None else reduced.reduction
        reduction = reduction if converged is None else converged.reduction
        source = context.get(Source)
        options = run_settings(source, context.get(ModelChoices))
        return [verify(shot, reduction, result, options, context.progress)]


register, unregister = registration(
    AnalyseShot, RefineReduction, PlanStep, EstimateMotorEffects, CompareWithLimits, VerifyResult
)
