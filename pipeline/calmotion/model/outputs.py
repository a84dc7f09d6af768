"""Values that travel between the command line, the host and plugins, beside those of `calmotion.model`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from calmotion.arrays import Array
from calmotion.model.animation import Track
from calmotion.model.limits.use import LimitUse
from calmotion.model.result import Simplification

ERROR, WARNING = "error", "warning"  # levels of a `Finding`


@dataclass(frozen=True)
class WrittenLayer:
    """Paths of the layer of overs and of the root layer that opens it with the shot."""

    layer: str
    root: str


@dataclass(frozen=True)
class RiggedJoint:
    """The robot's part for one joint of a skeleton: its body, its motors, and the residual angle [rad] between the
    animation and the motors."""

    joint: str
    body: str
    motors: tuple[str, ...]
    off: float


@dataclass(frozen=True)
class Rig:
    """The robot that is made from a skinned character, or from animated parts.

    Attributes:
        layer: Path of the layer, which opens with the shot beneath it.
        robot: Prim path of the robot.
        joints: The joints of the skeleton, or the parts, with their motors.
        bodies: Number of bodies, servos included.
        mass: Of all of them [kg].
        targets: Prim paths.
        flexible: Prim paths of the flexible bodies.
        off: Largest distance of an animated part, or of a skeleton's joint, from where the robot has it [m].
        notes: Sentences for the user.
    """

    layer: str
    robot: str
    joints: tuple[RiggedJoint, ...]
    bodies: int
    mass: float
    targets: tuple[str, ...]
    flexible: tuple[str, ...] = ()
    off: float = 0.0
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Recording:
    """Path of a rerun recording."""

    path: str


@dataclass(frozen=True)
class CsvFile:
    """Path of a table."""

    path: str


@dataclass(frozen=True)
class Figures:
    """Paths of the figures."""

    paths: tuple[str, ...]


@dataclass(frozen=True)
class TempoFigure:
    """Path of the figure of the tempo that a robot needs for an animation."""

    path: str


@dataclass(frozen=True)
class Video:
    """Path of a video."""

    path: str


@dataclass(frozen=True, eq=False)
class Plots:
    """Curves of a result, each figure under its heading: `matplotlib.figure.Figure`, drawn but not saved."""

    figures: tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class TextTable:
    """A table of a report; its first `texts` columns are text, the others numbers."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    texts: int = 1


@dataclass(frozen=True)
class Section:
    """A part of a report under a heading: sentences and tables in their order."""

    title: str
    parts: tuple[str | TextTable, ...]


@dataclass(frozen=True, eq=False)
class PageContent:
    """What a page says of a result.

    Attributes:
        title: Of the page.
        sections: The words of the report on the screen, the verdict first.
        provenance: Where it comes from: values by their names, or lists of them.
        plots: Figures that are not among the `Plots` of the run.
    """

    title: str
    sections: tuple[Section, ...]
    provenance: Mapping[str, Any] = field(default_factory=dict)
    plots: tuple[tuple[str, Any], ...] = ()


@dataclass(frozen=True)
class HtmlPage:
    """Path of a page."""

    path: str


@dataclass(frozen=True)
class ModeShapes:
    """Paths of the files that show the modes of the flexible bodies."""

    paths: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ShapedTracks:
    """The motors' tracks after an input shaper or a filter, in the motors' order."""

    tracks: tuple[Track, ...]


@dataclass(frozen=True)
class Verification:
    """A run compared with a finer one of the same curves.

    Attributes:
        error_m: Largest distance between a target in both runs, over all frames [m].
        step_s: Step of the finer run [s].
        modes: Its elastic coordinates.
        mesh_m: Estimated error of its meshes at the targets [m], by which the distance may be too small.
    """

    error_m: float
    step_s: float
    modes: int
    mesh_m: float = 0.0

    @property
    def bound_m(self) -> float:
        """What the error of the run is at most, as far as is known [m]."""
        return self.error_m + self.mesh_m


@dataclass(frozen=True, eq=False)
class PlannedStep:
    """The time step of a simulation of the shot, as a row of the simplifications."""

    row: Simplification


@dataclass(frozen=True, eq=False)
class MotorEffects:
    """What the animation does if motors give by their gains, and if they are ideal; links are flexible in both.

    Attributes:
        motors: Paths of the motors that have gains; none where the robot could not follow the animation with them.
        lag: Largest error of each target [m], shape [K]; here and below of no target where there are no motors.
        droop: Its error at rest at the start [m], shape [K].
        ideal_lag, ideal_droop: The same with ideal motors.
    """

    motors: tuple[str, ...]
    lag: Array
    droop: Array
    ideal_lag: Array
    ideal_droop: Array


@dataclass(frozen=True)
class TooWeak:
    """A pose that a motor cannot hold, whatever the tempo: weight and springs alone need more than it has.

    Attributes:
        motor: Its index.
        time_s: When, in the animation [s].
        needed: Effort [N m or N].
    """

    motor: int
    time_s: float
    needed: float


@dataclass(frozen=True, eq=False)
class Tempo:
    """How much slower a motion has to be.

    Attributes:
        uniform: Least stretch of the whole that keeps all limits, 1 where they are kept; infinite where a motor cannot
            hold the robot in a pose.
        uniform_added_s, least_added_s: Time that this adds, and the least that is added where only what must is slower
            [s]. The latter does not know limits of jerk.
        times: Of the animation [s], shape [T].
        stretch: Of the fastest performance at these, shape [T].
        too_weak: The pose that is farthest beyond its motor; None where all are held.
    """

    uniform: float
    uniform_added_s: float
    least_added_s: float
    times: Array
    stretch: Array
    too_weak: TooWeak | None = None


@dataclass(frozen=True, eq=False)
class ExceededLimits:
    """The limits of motors that the animation exceeds.

    Attributes:
        uses: Each where it does most.
        tempo: How much slower it has to be; None where that would not help (positions), or is not known.
    """

    uses: tuple[LimitUse, ...]
    tempo: Tempo | None = None


@dataclass(frozen=True, eq=False)
class SystemModes:
    """Natural modes of the whole character in one pose of the shot, motors held.

    Attributes:
        frequencies: [Hz], ascending.
        damping: Their ratios of critical.
        time_s: When the shot has this pose [s].
    """

    frequencies: Array
    damping: Array
    time_s: float = 0.0


@dataclass(frozen=True)
class Finding:
    """An error or a warning about a shot.

    Attributes:
        level: `error` (the shot cannot be processed, or USD calls it invalid) or `warning`.
        rule: Which rule found it, such as `usdPhysicsValidators:RigidBodyChecker`.
        path: Prim path, or file.
        attribute: Attribute or relationship, or empty.
        problem: As a sentence without a full stop.
        found: The value that was found, or empty.
        remedy: What to do, or empty where the rule is not ours and does not say.
    """

    level: str
    rule: str
    path: str
    attribute: str
    problem: str
    found: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class Findings:
    """All of them, errors first."""

    items: tuple[Finding, ...]
