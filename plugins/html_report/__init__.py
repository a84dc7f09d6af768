"""Shows a result as one self-contained page (.html)."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.model import Animation, Character, HtmlPage, OutputPaths, PageContent, Plots, Result


class WritePage(Operator):
    """The words of the report, curves to hover over, and the motion before and after in a 3D player."""

    idname = "html.write"
    label = "Write the page"
    requires = (PageContent, OutputPaths)
    uses = (Character, Animation, Result, Plots)
    provides = (HtmlPage,)
    properties = (
        Property("triangles", int, 120000, minimum=1000, maximum=400000, description="Largest number in the 3D player"),
        Property(
            "rate", float, 240.0, unit="Hz", minimum=10.0, maximum=1000.0,
            description="Largest rate of the motion in the 3D player; a long one has fewer samples",
        ),
    )  # fmt: skip

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """Skipped where no page is requested."""
        return None if data[OutputPaths].html else NotAsked("no page is requested (--html)")

    def execute(self, context: RunContext) -> Sequence[object]:
        """Write the page; its path."""
        from .page import write_page
        from .scene import Detail, scene_of

        content, path = context.get(PageContent), context.get(OutputPaths).html or ""
        character, animation, result = context.get(Character), context.get(Animation), context.get(Result)
        plots = [*content.plots, *(found.figures if (found := context.get(Plots)) else ())]
        scene = None
        if character is not None and animation is not None and result is not None:
            context.progress(0.1, "motion")
            detail = Detail(context.properties.triangles, context.properties.rate)
            scene = scene_of(character, result.performed_animation(animation), result, detail)
        context.progress(0.7, "page")
        return (HtmlPage(write_page(path, content, plots, scene)),)


register, unregister = registration(WritePage)
