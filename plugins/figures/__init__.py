"""Draws a result as figures (.png)."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import Operator, Property, RunContext, registration
from calmotion.model import (
    Animation,
    Character,
    ExceededLimits,
    Figures,
    OutputPaths,
    Plots,
    Result,
    SystemModes,
    TempoFigure,
)


class PlotFigures(Operator):
    """Errors over time and by frequency, motor curves with their limits, convergence, and the motion in pictures."""

    idname = "figures.plot"
    label = "Draw the figures"
    requires = (Character, Animation, Result, OutputPaths)
    uses = (SystemModes,)
    provides = (Figures,)
    properties = (
        Property("dpi", int, 150, minimum=30, maximum=600, description="Resolution of the figures, dots per inch."),
        Property("instants", int, 5, minimum=1, maximum=12, description="Number of instants in the filmstrip."),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        paths = data.get(OutputPaths)
        return None if paths and paths.figures else "no figures are requested (--figures)"

    def execute(self, context: RunContext) -> Sequence[object]:
        from .drawing import draw_figures

        result = context.get(Result)
        written = draw_figures(
            context.get(OutputPaths).figures or "",
            context.get(Character),
            result.performed_animation(context.get(Animation)),
            result,
            modes=context.get(SystemModes),
            dpi=context.properties.dpi,
            instants=context.properties.instants,
            progress=context.progress,
        )
        return (Figures(tuple(written)),)


class PlotCurves(Operator):
    """The figures of curves, for what shows them in another way than as files."""

    idname = "figures.curves"
    label = "Draw the curves"
    requires = (Character, Result)
    uses = (SystemModes,)
    provides = (Plots,)

    def execute(self, context: RunContext) -> Sequence[object]:
        """The figures under their headings."""
        from .drawing import plots_of

        drawn = plots_of(context.get(Character), context.get(Result), context.get(SystemModes))
        return (Plots(tuple((heading, figure) for _, heading, figure in drawn)),)


class PlotNeededTempo(Operator):
    """How much slower an animation would have to be, and where."""

    idname = "figures.tempo"
    label = "Draw the tempo that the motors allow"
    requires = (Character, ExceededLimits, OutputPaths)
    provides = (TempoFigure,)
    properties = PlotFigures.properties[:1]

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        paths, exceeded = data.get(OutputPaths), data.get(ExceededLimits)
        if not (paths and paths.figures):
            return "no figures are requested (--figures)"
        if exceeded is not None and exceeded.tempo is None:
            return "the animation exceeds no limit that a slower tempo would keep"
        if exceeded is not None and exceeded.tempo is not None and exceeded.tempo.too_weak is not None:
            return "no tempo helps"
        return None

    def execute(self, context: RunContext) -> Sequence[object]:
        from .tempo import write_needed_tempo

        folder = context.get(OutputPaths).figures or ""
        path = write_needed_tempo(folder, context.get(Character), context.get(ExceededLimits), context.properties.dpi)
        return (TempoFigure(path),)


register, unregister = registration(PlotFigures, PlotCurves, PlotNeededTempo)
