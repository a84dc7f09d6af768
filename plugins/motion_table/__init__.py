"""Joint trajectories from tables: `--motion FILE.csv` or `--motion FILE.npz`."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.host import NotAsked, Operator, Property, RunContext, registration
from calmotion.model import MotorTracks, Source
from calmotion.support import TIME_UNITS

SUFFIXES = (".csv", ".npz")


class ReadTable(Operator):
    """Columns of a table as tracks of motors: time_s, and a column for each joint in rad or m."""

    idname = "motion.read"
    label = "Read the motion"
    requires = (Source,)
    provides = (MotorTracks,)
    properties = (
        Property("angles", str, "auto", choices=("auto", "rad", "deg"),
                 description="Unit of angles; auto: as a header of the table says, else rad"),
        Property("times", str, "auto", choices=("auto", *TIME_UNITS),
                 description="Unit of the times of a table; auto: as their column is named, else by their size"),
        Property("rate", float, 0.0, unit="Hz", minimum=0.0, maximum=1e5,
                 description="Rows a second of a table without time_s"),
        Property("joints", str, "",
                 description="Joints of the columns, in their order, of a table without names: pan, lift, -, elbow (- "
                 "leaves a column out)"),
    )  # fmt: skip

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """Only for files that are named `.csv` or `.npz`."""
        motion = data[Source].motion
        if motion is None:
            return NotAsked("no motion is given (--motion)")
        return None if motion.lower().endswith(SUFFIXES) else NotAsked("the motion is not a table")

    def execute(self, context: RunContext) -> Sequence[object]:
        """The tracks."""
        from .tables import read_motion

        path, values = context.get(Source).motion, context.properties
        assert path is not None  # poll
        names = [name.strip() for name in values.joints.split(",")] if values.joints else []
        motion = read_motion(path, angles=values.angles, times=values.times, rate=values.rate, names=names)
        tracks = motion.tracks
        for note in motion.notes:
            context.report("info", note)
        context.report(
            "info", f"{path}: {len(tracks.values)} joint{'s' * (len(tracks.values) > 1)}, {tracks.times[-1]:.4g} s"
        )
        last = len(tracks.times) - 1
        if values.rate > 0.0 and abs(tracks.times[-1] * values.rate - last) > 0.01 * last:
            context.report("info", f"{path}: the table has times, so that motion.read.rate is not used")
        if names and not set(names) <= {*tracks.values, "-"}:
            context.report("info", f"{path}: the table has names, so that motion.read.joints is not used")
        return (tracks,)


register, unregister = registration(ReadTable)
