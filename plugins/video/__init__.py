"""Shows a result as a video (.webp, or .mp4 by an installed ffmpeg)."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.model import Animation, Character, OutputPaths, Result, Video


class WriteVideo(Operator):
    """As animated and optimised side by side over the intended motion, with the error below; then the worst moment in
    slow motion."""

    idname = "video.write"
    label = "Write the video"
    requires = (Character, Animation, Result, OutputPaths)
    provides = (Video,)
    checks = (OutputPaths,)
    properties = (
        Property("width", int, 1120, minimum=320, maximum=3840, description="Width of the video, pixels"),
        Property("rate", float, 25.0, unit="Hz", minimum=5.0, maximum=60.0, description="Frames per second"),
        Property("slow", float, 0.2, minimum=0.02, maximum=1.0, description="Speed of the slow motion; 1: none"),
        Property("quality", int, 80, minimum=1, maximum=100, description="Quality of the pictures of a .webp file"),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """Skipped where no video is requested."""
        return None if data[OutputPaths].video else NotAsked("no video is requested (--video)")

    def check(self, context: RunContext) -> None:
        """A kind of file that can be written."""
        from .encoding import refuse_unknown_kind

        refuse_unknown_kind(context.get(OutputPaths).video or "")

    def execute(self, context: RunContext) -> Sequence[object]:
        """Write the video; its path."""
        from .film import Settings, write_video

        values, result = context.properties, context.get(Result)
        path = context.get(OutputPaths).video or ""
        write_video(
            path,
            context.get(Character),
            result.performed_animation(context.get(Animation)),
            result,
            Settings(values.width, values.rate, values.slow, values.quality),
            context.progress,
        )
        return (Video(path),)


register, unregister = registration(WriteVideo)
