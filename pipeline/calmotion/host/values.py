"""Values that travel between the command line, the host and plugins, beside those of `calmotion.shot`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..fem import ReducedBody
    from ..retarget.motion_subspace import Known
    from ..shot import LeftOut, ModeTable, Track
    from ..shot.character import Array


@dataclass(frozen=True)
class Source:
    """What the user asked for.

    Attributes:
        path: The shot.
        command: `inspect`, `simulate` or `optimize`.
        tolerance: Error at the targets that does not matter [m], or None for the shot's own.
        step: Time step [s], or None for automatic.
        integrator: Name of the integrator, or None for automatic.
        pre_roll: Length of the pre-roll [s], or None for automatic.
        shaper: Input shaper or filter through which `simulate` passes the motors' tracks first, or None.
        motion: File with a motion that replaces tracks of motors, or None.
        verify: Whether the result is to be compared with a finer run.
    """

    path: str
    command: str
    tolerance: float | None = None
    step: float | None = None
    integrator: str | None = None
    pre_roll: float | None = None
    shaper: str | None = None
    motion: str | None = None
    verify: bool = False


@dataclass(frozen=True)
class OutputPaths:
    """Where the results go; None: not asked for."""

    layer: str | None = None
    rrd: str | None = None
    csv: str | None = None
    figures: str | None = None
    modes: str | None = None


@dataclass(frozen=True)
class WrittenLayer:
    """Paths of the layer of overs and of the root layer that opens it with the shot."""

    layer: str
    root: str


@dataclass(frozen=True)
class RiggedJoint:
    """What became of one joint of a skeleton: the body that turns with it, the joints that turn that, and the angle
    [rad] that they leave of the animation."""

    joint: str
    body: str
    motors: tuple[str, ...]
    off: float


@dataclass(frozen=True)
class Rig:
    """A robot that was made of a skinned character.

    Attributes:
        layer: Path of the layer, which opens with the shot beneath it.
        robot: Prim path of the robot.
        joints: What turns, each with its motors.
        bodies: Number of bodies, servos included.
        mass: Of all of them [kg].
        targets: Prim paths.
    """

    layer: str
    robot: str
    joints: tuple[RiggedJoint, ...]
    bodies: int
    mass: float
    targets: tuple[str, ...]


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
class ModeShapes:
    """Paths of the files that show the modes of the flexible bodies."""

    paths: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ReducedBodies:
    """Bodies as the dynamics takes them, and the frequencies of the flexible ones.

    Attributes:
        bodies: One for each body of the character.
        modes: One for each flexible body.
        error_m: How far a finer reduction moves a target in the shot [m]; None where that was not found out.
        known: The shot as animated, simulated with these bodies; None where that was not done.
    """

    bodies: tuple[ReducedBody, ...]
    modes: tuple[ModeTable, ...]
    error_m: float | None = None
    known: Known | None = None


@dataclass(frozen=True, eq=False)
class ShapedTracks:
    """The motors' tracks after an input shaper or a filter, in the motors' order."""

    tracks: tuple[Track, ...]


@dataclass(frozen=True)
class Verification:
    """A run compared with a finer one of the same curves.

    Attributes:
        error_m: Largest distance of any target, at any frame, to where the finer run has it [m].
        step_s: Step of the finer run [s].
        modes: Its elastic coordinates.
    """

    error_m: float
    step_s: float
    modes: int


@dataclass(frozen=True, eq=False)
class PlannedStep:
    """The time step that a simulation of the shot would take: what it leaves out."""

    row: LeftOut


@dataclass(frozen=True, eq=False)
class SystemModes:
    """Natural modes of the whole character in its first pose, motors held.

    Attributes:
        frequencies: [Hz], ascending.
        damping: Their ratios of critical.
    """

    frequencies: Array
    damping: Array
