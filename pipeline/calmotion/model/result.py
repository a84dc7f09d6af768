"""Results: simulated motions, errors, and curves."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from calmotion.arrays import Array
from calmotion.model.animation import Animation
from calmotion.model.character import Character
from calmotion.model.limits.use import LimitUse, TermUse, is_kept
from calmotion.model.run import SearchRecord
from calmotion.model.tempo import TempoReport
from calmotion.model.tolerance import BudgetEntry
from calmotion.model.uncertainty import Robustness


@dataclass(frozen=True, eq=False)
class Retimed:
    """An animation at the tempo that was found for it.

    Attributes:
        animation: At that tempo, which it has.
        character: Whose contacts come and go at that tempo.
        report: What the tempo costs.
    """

    animation: Animation
    character: Character
    report: TempoReport


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of the whole character, one row a time step (T steps, B bodies, J joints, M motors, K targets).

    Attributes:
        times: [s] after the first frame of the shot, shape [T]; negative during a pre-roll.
        positions: Origins of the body frames [m], shape [T, B, 3], world.
        rotations: Unit quaternions (w, x, y, z) of the body frames, shape [T, B, 4], world.
        elastic: Elastic coordinates of each body, B arrays of shape [T, r_b] (r_b = 0 for a rigid body).
        motor_values: Motor angles [rad] or lengths [m], shape [T, M].
        motor_efforts: Motor torques [N m] or forces [N], shape [T, M]; NaN in a motion that was not simulated.
        target_positions: [m], shape [T, K, 3], world.
        target_rotations: Unit quaternions, shape [T, K, 4], world.
        joint_forces, joint_moments: What each joint does to its body1 [N], [N m], world axes, shape [T, J, 3]; the
            moment is about the joint's frame on the body farther from the world. None in a motion that was not
            simulated.
    """

    times: Array
    positions: Array
    rotations: Array
    elastic: tuple[Array, ...]
    motor_values: Array
    motor_efforts: Array
    target_positions: Array
    target_rotations: Array
    joint_forces: Array | None = None
    joint_moments: Array | None = None

    @property
    def judged(self) -> slice:
        """The rows from the first frame of the shot on: what lies before is a pre-roll."""
        # times are sums of steps: rounding may put the first frame just before 0
        return slice(int(np.searchsorted(self.times, -1e-9)), None)


@dataclass(frozen=True, eq=False)
class Simulation:
    """A motion that was simulated, and its cost.

    Attributes:
        motion: The motion.
        position_errors: Distance of each target to the reference [m], shape [T, K].
        rotation_errors: Angle of each target to the reference [rad], shape [T, K].
        newton_iterations: In all.
        max_joint_gap: Largest position gap of any joint at any step [m].
        wall_s: Time of this forward simulation alone [s].
        sag: Distance of each target at rest, before it moves, to that of a rigid robot on the same commands [m], [K].
        refined_steps: Steps that only smaller ones reached.
        dead_centres: Times at which closed chains pass a singular pose [s], shape [n].
        seam: Gap of each target between start and end of a cycle [m], shape [K]; empty for a shot that is not cyclic.
        floquet_multiplier: Largest Floquet multiplier of the periodic motion; above 1 the motion is unstable.
    """

    motion: Motion
    position_errors: Array
    rotation_errors: Array
    newton_iterations: int
    max_joint_gap: float
    wall_s: float
    sag: Array = field(default_factory=lambda: np.zeros(0))
    refined_steps: int = 0
    dead_centres: Array = field(default_factory=lambda: np.zeros(0))
    seam: Array = field(default_factory=lambda: np.zeros(0))
    floquet_multiplier: float = 0.0

    @property
    def time_of_largest_error(self) -> float:
        """When any target is farthest from its place, from the first frame on [s]; 0 without targets."""
        errors = self.position_errors[self.motion.judged]
        if not errors.size:
            return 0.0
        return float(self.motion.times[self.motion.judged][int(np.argmax(errors.max(axis=1)))])


@dataclass(frozen=True, eq=False)
class Skin:
    """How a flexible body's elastic coordinates move its surfaces: point i of surface s moves by
    `modes[s][i] @ u`, shape [n_s, 3, r], body axes [m per unit of the coordinates]."""

    modes: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class MotorCurve:
    """The optimised curve of one motor, `input + offset`.

    Attributes:
        motor: Motor index.
        changed: False when the offset is exactly zero; such a motor is not written.
        knots: Knots of the offset's cubic spline [s], shape [n]; frames of the shot.
        frame_values: The optimised curve at the shot's frames [rad or m], shape [f].
        max_offset: Largest change during the shot, without the pre-roll [rad or m].
    """

    motor: int
    changed: bool
    knots: Array
    frame_values: Array
    max_offset: float


@dataclass(frozen=True, eq=False)
class Simplification:
    """A model simplification, or a step of the pipeline that was not needed.

    Attributes:
        what: What was left out; the label of the step.
        why: The reason.
        estimated_error_m: What it costs at the targets [m]; None: nothing, or not known.
        source: Entry of the error budget that it is part of, one of `shot.budget`, or empty.
        skipped: Whether it is a step.
    """

    what: str
    why: str
    estimated_error_m: float | None = None
    source: str = ""
    skipped: bool = False


GOAL_REACHED, LIMITS_EXCEEDED = "goal reached", "limits exceeded"  # why a search ended
_AT_AN_END = ("converged", "no further decrease", GOAL_REACHED)
_NOTICED_RISE = 0.01  # of the tolerance


MESH, EARLIER_MESH, SECTIONS = "mesh", "earlier mesh", "sections"  # sources of frequencies


@dataclass(frozen=True, eq=False)
class ModeTable:
    """Frequencies of a flexible body [Hz], clamped at its parent side, the size of its mesh, and the relative error of
    its stiffness by the mesh (None: not known).

    Attributes:
        source: What they come from: `MESH`, `EARLIER_MESH` (of a run before) or `SECTIONS`, which is rough.
        volume: Of the sections [m^3]; None with a mesh.
    """

    body: int
    frequencies: Array
    nodes: int
    elements: int
    mass: float
    mesh_error: float | None = None
    source: str = MESH
    volume: float | None = None


@dataclass(frozen=True, eq=False)
class Accuracy:
    """Estimated distance of the simulated targets from those of a finer simulation.

    Attributes:
        step_m: Estimated error of the time step [m].
        left_out_m: Estimated error of the model simplifications, those of `subspace_m` and `choices_m` included [m].
        mesh_m: Estimated error of the finite-element meshes [m]; None where it is not known.
        subspace_m: Estimated error of the POD subspaces [m].
        choices_m: Estimated error of what the analysis of the shot left out, before bodies were reduced [m].
        efforts: Estimated error of each motor's effort by the time step [N m] or [N], shape [M]; None: not known.
    """

    step_m: float
    left_out_m: float
    mesh_m: float | None = None
    subspace_m: float = 0.0
    choices_m: float = 0.0
    efforts: Array | None = None

    @property
    def estimated_m(self) -> float:
        """Sum of `step_m` and `left_out_m` [m], without the mesh error: the tolerance does not refine the mesh."""
        return self.step_m + self.left_out_m


@dataclass(frozen=True, eq=False)
class ErrorShares:
    """Largest error of each target in the input, shape [K] [m], where only one cause of it is left.

    Attributes:
        motors_m: With rigid links: that of compliant motors.
        links_m: With ideal motors: that of flexible links.
    """

    motors_m: Array
    links_m: Array


@dataclass(frozen=True, eq=False)
class LostMotion:
    """What the play of gears would do to a simulated motion, see `accuracy.motors.backlash`.

    Attributes:
        motors: Indices of the motors that have play.
        reversals: For each of them, when the torque of its gear changes its sign [s].
        largest_m, time_s: Largest way of each target across the play [m], shape [K], and when [s].
        unknown: Those of the motors whose play is not part of it, since a rigid robot cannot follow it.
    """

    motors: tuple[int, ...]
    reversals: tuple[Array, ...]
    largest_m: Array
    time_s: Array
    unknown: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Result:
    """What a run computed. `simulate` fills `before` alone; `optimize` also `after` and what follows it.

    Attributes:
        reference: The intended motion: the input on a rigid robot; same times as the simulations.
        before: The input, simulated.
        after: The optimised curves, simulated, or None.
        skins: One for each body; None for a rigid one.
        modes: One for each flexible body.
        curves: One for each motor, empty for `simulate`.
        search: How the curves were found; that of no iteration for `simulate`.
        objective_before, objective_after: Value of the objective.
        wall_s: The optimisation alone (or the simulation, for `simulate`) [s].
        step_s: Time step [s].
        pre_roll_s: Length of the pre-roll [s].
        dof: Number of position coordinates (6 a body, and the elastic ones).
        left_out: What was left out.
        limits: Limits of the motors.
        performed: A rigid robot performing the curves that were found (or simulated); same times. None where a
            linkage cannot follow them rigidly.
        accuracy: Of the motion that counts, `after` or else `before`; None where it was not estimated.
        tolerance_m: Accuracy of the simulation at the targets [m].
        budget: What each approximation may cost and is estimated to cost, largest first; empty where it is not known.
        error_shares: What motors and links have in the error of the input; None where motors are ideal.
        lost_motion: What the play of gears would do to the input, and to the curves found; empty without play.
        robustness: The curves on robots that differ from the model; None where they were optimised for one robot.
        friction_band_m: How far Coulomb friction may hold each target off at rest [m], shape [K]; None without any.
        goal_m: Error that is accepted at the targets [m]; None where none is named.
        terms: Residuals and limits of plugins.
        retimed: The animation at the tempo that was found, to whose times all motions belong; None: at its own.
    """

    reference: Motion
    before: Simulation
    after: Simulation | None
    skins: tuple[Skin | None, ...]
    modes: tuple[ModeTable, ...]
    curves: tuple[MotorCurve, ...]
    objective_before: float
    objective_after: float | None
    wall_s: float
    step_s: float
    pre_roll_s: float
    dof: int
    search: SearchRecord = SearchRecord()
    left_out: tuple[Simplification, ...] = ()
    limits: tuple[LimitUse, ...] = ()
    performed: Motion | None = None
    accuracy: Accuracy | None = None
    tolerance_m: float = 0.0
    budget: tuple[BudgetEntry, ...] = ()
    error_shares: ErrorShares | None = None
    lost_motion: tuple[LostMotion, ...] = ()
    robustness: Robustness | None = None
    friction_band_m: Array | None = None
    retimed: Retimed | None = None
    goal_m: float | None = None
    terms: tuple[TermUse, ...] = ()

    @property
    def interrupted(self) -> bool:
        """Whether the user ended the search; the best curves so far are here."""
        return self.search.interrupted

    def with_limits_told(self) -> Result:
        """This result, whose search is not said to be at an end where limits of motors or plugins are not kept."""
        kept = all(map(is_kept, self.limits)) and all(map(is_kept, self.terms))
        if kept or self.search.stopped not in _AT_AN_END:
            return self
        return replace(self, search=replace(self.search, stopped=LIMITS_EXCEEDED))

    def performed_animation(self, animation: Animation) -> Animation:
        """An animation at the tempo of this result."""
        return animation if self.retimed is None else self.retimed.animation

    @property
    def improved(self) -> bool | None:
        """Whether the curves found leave no larger error than the animation, None where there are none.

        Robust curves are judged on the random robots, others on the robot of the model. A rise of the largest error of
        all targets by less than a hundredth of the tolerance does not count, since the simulation is no better.
        """
        if self.after is None:
            return None
        if self.robustness is not None:
            over = np.max if self.robustness.kind == "worst" else np.mean
            before, after = (float(over(self.robustness.drawn[name][..., 0])) for name in ("before", "robust"))
            return after <= before
        before, after = (
            float(np.max(run.position_errors[run.motion.judged], initial=0.0)) for run in (self.before, self.after)
        )
        falls = self.objective_after is not None and self.objective_after <= self.objective_before
        return falls and after <= before + _NOTICED_RISE * self.tolerance_m
