"""Motion captures onto motors: run with `--motion FILE.bvh --set bvh.read.map="RightArm.Zrotation=shoulder"`."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.model import MotorTracks, Source


class ReadMotion(Operator):
    """Channels of a BVH file as tracks of motors, beginning with the shot."""

    idname = "bvh.read"
    label = "Read the motion"
    requires = (Source,)
    provides = (MotorTracks,)
    properties = (
        Property(
            "map",
            str,
            "",
            description="Which channel drives which motor, optionally with a factor and an offset: "
            '"RightArm.Zrotation=shoulder, RightForeArm.Yrotation=elbow*-1+90deg"',
        ),
        Property("unit", float, 0.01, unit="m", minimum=1e-9, description="Length of the file's unit, for positions"),
        Property("start", float, 0.0, unit="s", minimum=0.0, description="Time in the file at which the shot begins"),
    )

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """Only for files that are named `.bvh`."""
        motion = data[Source].motion
        if motion is None:
            return NotAsked("no motion is given (--motion)")
        return None if motion.lower().endswith(".bvh") else NotAsked("the motion is not a BVH file")

    def execute(self, context: RunContext) -> Sequence[object]:
        """The tracks."""
        from .bvh import read_bvh
        from .mapping import mapped_tracks, notes_on, read_mapping

        path, values = context.get(Source).motion, context.properties
        assert path is not None  # poll
        motion = read_bvh(path)
        entries = read_mapping(values.map, motion)
        tracks = mapped_tracks(motion, entries, unit=values.unit, start=values.start)
        context.report(
            "info",
            f"{path}: {len(tracks.values)} of {len(motion.channels)} channels drive motors, {tracks.times[-1]:.4g} s",
        )
        for note in notes_on(motion, entries, values.unit):
            context.report("info", f"{path}: {note}")
        return (tracks,)


register, unregister = registration(ReadMotion)
