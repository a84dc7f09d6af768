"""Simulates and retargets shots."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.errors import ShotError
from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.model import (
    Animation,
    Character,
    ModelChoices,
    OutputPaths,
    Provenance,
    Result,
    RobustSettings,
    ShapedTracks,
    Source,
    TempoSettings,
    TermUse,
    is_exceeded,
    is_reached,
    run_settings,
    simplified_character,
    with_choices,
)
from calmotion.retargeting import SearchTerms
from calmotion.simulation import CompiledShot
from calmotion.tolerance import ConvergedReduction, compiled_in


def _options(context: RunContext, **more: Any) -> Any:
    """The user's request, with what the user forced of the model."""
    return run_settings(context.get(Source), context.get(ModelChoices), **more)


def _with_budget(context: RunContext, result: Result, **more: float) -> Result:
    """The result with the decisions on the model, its error budget, and the parts of motors and links in its error."""
    from calmotion.retargeting import best_so_far
    from calmotion.tolerance import with_budget, with_error_shares, with_friction_band, with_lost_motion

    shot, tolerance = compiled_in(context.get).at(result.retimed), context.get(Source).settings.tolerance
    try:
        if not result.interrupted:
            result = with_error_shares(shot, result, _options(context), context.progress)
            result = with_lost_motion(shot, result, _options(context))
            result = with_friction_band(shot, result, _options(context))
    except KeyboardInterrupt:
        if result.after is None:  # of a simulation: it is soon done again
            raise
        result = best_so_far(result)
    return with_budget(with_choices(result, context.get(ModelChoices)), shot.character, tolerance, **more)


def _input(context: RunContext) -> tuple[Character | None, Animation | None]:
    """The character with its simplifications and its animation; None where only a compiled shot was given."""
    character: Character | None = context.get(Character)
    if character is not None:
        character = simplified_character(character, context.get(ModelChoices))
    return character, context.get(Animation)


def _told(term: TermUse) -> str:
    """What became of a limit of a plugin that is exceeded, as a clause."""
    before, after, limit = (f"{v:.4g} {term.unit}".rstrip() for v in (term.before, term.after, term.limit))
    where = f" of {term.label}" if term.label else ""
    return f"{term.name}{where} exceeds its limit {limit}: {after} at {term.time_s:.3f} s, {before} before"


def _wrong_command(data: Mapping[type, Any], command: str) -> str | None:
    source = data.get(Source)
    return None if source is None or source.command == command else NotAsked(f"the command is {source.command}")


class ShapeTracks(Operator):
    """Filters the tracks of the motors with an input shaper or a low-pass filter, to compare with."""

    idname = "retarget.shape"
    label = "Filter the tracks of the motors"
    requires = (CompiledShot, Source)
    uses = (ConvergedReduction, ModelChoices)
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
        from calmotion.simulation import shape_tracks

        kind, cutoff = context.get(Source).shaper or "", context.properties.cutoff
        return [ShapedTracks(shape_tracks(compiled_in(context.get), _options(context), kind, cutoff))]


class SimulateShot(Operator):
    """Simulates the shot as animated on the flexible robot."""

    idname = "retarget.simulate"
    label = "Simulate the shot"
    requires = (CompiledShot, Source)
    uses = (ConvergedReduction, ShapedTracks, ModelChoices, Character, Animation)
    provides = (Result,)
    checks = (Character, Animation, Source, ModelChoices)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        return _wrong_command(data, "simulate")

    def check(self, context: RunContext) -> None:
        from calmotion.tolerance import check_simulation

        character, animation = _input(context)
        if character is not None and animation is not None:
            check_simulation(character, animation, _options(context))

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.tolerance import simulate_to_tolerance

        shot, shaped, converged = compiled_in(context.get), context.get(ShapedTracks), context.get(ConvergedReduction)
        if shaped is not None:
            shot = shot.with_tracks(shaped.tracks)
        error, known = (None, None) if converged is None else (converged.error_m, converged.known)
        memory = None if converged is None else converged.memory
        result = simulate_to_tolerance(shot, _options(context), context.progress, error, known, memory)
        return [_with_budget(context, result)]


class OptimizeShot(Operator):
    """Finds motor curves with which the flexible robot performs the intended motion."""

    idname = "retarget.optimize"
    label = "Optimise the motor curves"
    requires = (CompiledShot, Source)
    uses = (ConvergedReduction, OutputPaths, ModelChoices, Character, Animation, Provenance, SearchTerms)
    provides = (Result,)
    checks = (Character, Animation, Source, ModelChoices, Provenance, SearchTerms)
    properties = (
        Property("max_iterations", int, 30, minimum=1, description="Largest number of Gauss-Newton iterations"),
        Property(
            "least_gain",
            float,
            None,
            minimum=0.0,
            maximum=1.0,
            description="The search ends where its next step should gain less than this part of the tolerance (rms); "
            "auto: a tenth",
        ),
        Property(
            "goal",
            float,
            None,
            unit="m",
            minimum=0.0,
            description="Error at the targets that is accepted: the search ends there; auto: that of the shot, or none",
        ),
        Property(
            "knot_spacing",
            float,
            None,
            unit="s",
            minimum=0.0,
            description="Distance of the knots; auto: that of the shot, or adaptive",
        ),
        Property(
            "smoothness",
            float,
            None,
            minimum=0.0,
            description="Weight of the second derivative of the offsets; auto: that of the shot",
        ),
        Property(
            "adjoint",
            str,
            "discrete",
            choices=("discrete", "continuous"),
            description="Source of the gradients; the continuous adjoint is not exact and has no limits of effort",
        ),
        Property(
            "robust",
            str,
            "off",
            choices=("off", "mean", "worst"),
            description="Optimise for a set of robots around the model: their mean, or the one with the largest error",
        ),
        Property(
            "scenarios",
            int,
            7,
            minimum=1,
            maximum=999,
            description="Number of these robots, the model among them",
        ),
        Property("retime", bool, False, description="Slow the animation down where limits of motors ask for it"),
        Property(
            "slowest",
            float,
            None,
            minimum=1.0,
            description="Largest stretch of any part of the animation; auto: that of the shot",
        ),
        Property(
            "fastest",
            float,
            None,
            minimum=0.01,
            maximum=1.0,
            description="Smallest stretch: below 1 parts may catch up; auto: that of the shot",
        ),
        Property(
            "pinned",
            str,
            "",
            description="Times whose distances stay as they are animated, with commas between them: time codes, or "
            "seconds after the first frame with an s; empty: those of the shot",
        ),
        Property(
            "draws", int, 200, minimum=20, maximum=100_000, description="Random robots on which the curves are measured"
        ),
        Property(
            "nominal_error",
            float,
            2.0,
            minimum=0.0,
            description="Largest error that robust curves may have on the model, over the tolerance; the smaller, the "
            "larger it is on other robots",
        ),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        return _wrong_command(data, "optimize")

    def check(self, context: RunContext) -> None:
        from calmotion.retargeting import check_search

        character, animation = _input(context)
        if character is not None and animation is not None:
            check_search(character, animation, self._search_options(context))

    def execute(self, context: RunContext) -> Sequence[object]:
        from calmotion.retargeting import (
            checkpoint_path,
            optimize_with_tempo,
            remove_checkpoint,
        )

        options = self._search_options(context)
        paths = context.get(OutputPaths)
        layer = paths.layer if paths is not None else None
        kept = checkpoint_path(layer) if layer else None
        converged = context.get(ConvergedReduction)
        known, memory = (None, None) if converged is None else (converged.known, converged.memory)
        shot = compiled_in(context.get)
        try:
            result = optimize_with_tempo(shot, options, context.progress, kept, known, memory)
        except ShotError:
            if kept:  # the same command would resume only to be refused again
                remove_checkpoint(kept)
            raise
        if result.interrupted:
            context.report(
                "warning", "interrupted: these are the best curves so far; the same command resumes from them"
            )
        result = _with_budget(context, result, least_gain=options.least_gain)
        for term in filter(is_exceeded, result.terms):
            context.report("warning", _told(term))
        if not result.improved:
            reason = f"the search ended: {result.search.stopped}"
            if any(map(is_exceeded, result.limits)):
                reason = "limits of motors are still exceeded. Slow the animation down there, or raise the limits"
            elif any(map(is_exceeded, result.terms)):
                reason = "limits of plugins are still exceeded. Slow the animation down there, or widen them"
            elif result.terms:
                reason = "residuals or limits of plugins count as well"
            elif any(map(is_reached, result.limits)):
                reason = "the limits of the motors require it"
            context.report(
                "warning",
                f"the new curves are worse than the animated ones: {reason}",
            )
        return [result]

    def _search_options(self, context: RunContext) -> Any:
        values, added = context.properties, context.get(SearchTerms)
        given = {"least_gain": values.least_gain} if values.least_gain else {}
        return _options(
            context,
            **given,
            terms=() if added is None else added.terms,
            max_iterations=values.max_iterations,
            goal=values.goal or None,
            knot_spacing=values.knot_spacing or None,
            smoothness=values.smoothness,
            adjoint=values.adjoint,
            retime=self._tempo(context) if values.retime else None,
            robust=None
            if values.robust == "off"
            else RobustSettings(values.robust, values.scenarios, values.draws, values.nominal_error),
        )

    @staticmethod
    def _tempo(context: RunContext) -> Any:
        """How the tempo may change: what the user says, else the shot."""
        from calmotion.retargeting import pinned_times

        values, character, provenance = context.properties, context.get(Character), context.get(Provenance)
        shot = TempoSettings() if character is None else character.retarget.tempo
        pinned = shot.pinned
        if values.pinned and provenance is not None:
            pinned = pinned_times(values.pinned, provenance.start_time_code, provenance.time_codes_per_second)
        return TempoSettings(values.slowest or shot.slowest, values.fastest or shot.fastest, pinned)


register, unregister = registration(ShapeTracks, SimulateShot, OptimizeShot)
