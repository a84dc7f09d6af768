"""The retargeting problem of a shot: its unknowns, objective and limits."""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.errors import ShotError
from calmotion.model import Animation, Character
from calmotion.model.character import motors_give
from calmotion.model.limits.bounds import Bounds, motor_bounds
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.model.model import rigid_model
from calmotion.multibody.motors.inverse import inverse_commands
from calmotion.retargeting.problem.adaptive_knots import FIT, breaks_for, first_breaks, fitted
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.offset_basis import OffsetBasis, basis_on, uniform_breaks
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.problem.robot import EFFORT
from calmotion.simulation.inputs.curves import Curves, coupling_of, leaders, sample_tracks
from calmotion.simulation.inputs.tempo import TEMPO_LIMITS
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.preparation import Prepared
from calmotion.simulation.simulator import Simulator
from calmotion.simulation.target_errors import IntendedMotion, Objective

SMOOTHNESS = 1e-10
CLOSENESS = 1e-4  # an offset of 0.1 rad has the weight of an error of 1 mm [m^2/rad^2]
AHEAD = 1e-4  # error of the spline fit to the rigid robot's commands, from which a search only starts [rad or m]
STILL = 1e3  # an animation that is slower by this factor has no inertial forces: they fall by its square
CLOSENESS_OF_COMMANDS = 3e-6  # the same where motors give: commands are ahead of the motion by what motors lag


def pose(
    prepared: Prepared,
    curves: Curves,
    intended: IntendedMotion,
    options: RunSettings,
) -> tuple[RetargetProblem, Array, bool]:
    """The retargeting problem of a shot, the start of its search, shape [n], and whether its knots are adaptive.

    Args:
        prepared: The shot on its time grid.
        curves: The animator's curves on the grid.

    Raises:
        ShotError: No motor may change, or options contradict each other.
    """
    character, grid, animation = prepared.character, prepared.grid, prepared.shot.animation
    ahead = None
    if motors_give(character) and animation.current is animation.tracks and options.max_iterations:
        ahead = _rigid_offsets(prepared, curves)
    known = unknowns(character, animation, grid, options, ahead)
    smoothness = next(v for v in (options.smoothness, character.retarget.smoothness, SMOOTHNESS) if v is not None)
    problem = RetargetProblem.of_model(
        prepared.model, grid, curves, Objective.over(prepared.model, intended, grid, animation.weights),
        OffsetSpace(known.basis, known.motors, known.coupling, smoothness, closeness_of(character)), prepared.world,
        _limits(known.bounds, grid, options), known.continuous,
    )  # fmt: skip
    offsets = known.offsets
    start = fitted(known.basis, offsets).ravel() if np.any(offsets) else np.zeros(problem.size)
    start = np.where(known.fixed, 0.0, start)
    if ahead is not None and not _merit(problem, start) < _merit(problem, np.zeros(problem.size)):
        start = np.zeros(problem.size)
    return problem, start, not knot_spacing(character, options)


def _limits(bounds: dict[str, Bounds], grid: TimeGrid, options: RunSettings) -> LimitTerms | None:
    limits = LimitTerms.of(bounds, grid.judged, grid.h)
    return None if limits is None else limits.shifted(EFFORT, options.between)


def _merit(problem: RetargetProblem, x: Array) -> float:
    """The merit at a point; infinite where it cannot be simulated."""
    at = problem.tried(x)
    return np.inf if at is None else at.merit


def _rigid_offsets(prepared: Prepared, curves: Curves) -> Array | None:
    """What the commands of the rigid robot on its motors are ahead of the animation, shape [T, m]; None where the rigid
    robot cannot follow it. Where the sag of each pose is intended, the motion alone counts and not the weight."""
    character = prepared.character
    try:
        commands = _rigid_commands(prepared, curves, 1.0)
        still = curves.angles if character.retarget.reference == "rigid" else _rigid_commands(prepared, curves, STILL)
    except SimulationFailure:
        return None
    return np.asarray((commands - still)[:, leaders(character)])


def _rigid_commands(prepared: Prepared, curves: Curves, slower: float) -> Array:
    """Commands under which the rigid robot on its motors performs the animation, slower by a factor, shape [T, M].

    Raises:
        SimulationFailure: It cannot follow the animation.
    """
    grid, rigid = prepared.grid, rigid_model(prepared.model)
    run = Simulator(rigid, slower * grid.h, prepared.world, grid.cyclic).run(curves.angles, curves.rates / slower)
    found = reactions(rigid.system, run.trajectory, run.joint_angles, run.joint_rates)
    efforts = rigid.motor_efforts(found.efforts)
    return inverse_commands(prepared.character.motors, slower * grid.times, curves.angles, efforts)


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What a search may change, from the shot's input alone.

    Attributes:
        basis: Of the offsets.
        motors: Those with unknowns, shape [m].
        coupling: Of all motors to these, shape [M, m].
        offsets: From which the search starts, shape [T, m].
        fixed: Coefficients that change a curve where the shot locks it, shape [P * m].
        bounds: Limits by the name of their quantity.
        continuous: Whether the adjoint is continuous.
    """

    basis: OffsetBasis
    motors: IntArray
    coupling: Array
    offsets: Array
    fixed: BoolArray
    bounds: dict[str, Bounds]
    continuous: bool


def closeness_of(character: Character) -> float:
    """Weight of the squared offsets [m^2/rad^2]."""
    return CLOSENESS_OF_COMMANDS if motors_give(character) else CLOSENESS


def knot_spacing(character: Character, options: RunSettings) -> float | None:
    """Requested distance of knots [s]; None where they are adaptive."""
    return options.knot_spacing or character.retarget.knot_spacing


def refuse_continuous(options: RunSettings, character: Character, what: str) -> None:
    """Refuse the continuous adjoint for what only the discrete one has.

    Raises:
        ShotError: It is asked for.
    """
    if options.adjoint == "continuous":
        raise ShotError(
            f"the continuous adjoint does not support {what}",
            path=character.path,
            attribute="retarget.optimize.adjoint",
            found=options.adjoint,
            remedy="Use the discrete adjoint.",
        )


def unknowns(
    character: Character, animation: Animation, grid: TimeGrid, options: RunSettings, offsets: Array | None = None
) -> Unknowns:
    """What a search may change.

    Args:
        offsets: From which it starts, shape [T, m]; None: from those that the shot already contains.

    Raises:
        ShotError: No motor may change, or options contradict each other.
    """
    settings, motors = character.retarget, leaders(character)
    coupling = coupling_of(character, motors)
    kept_ends = settings.endpoints == "kept"
    allowed = FIT if offsets is None else AHEAD
    offsets = existing_offsets(animation, grid, motors) if offsets is None else offsets
    spacing = knot_spacing(character, options)
    if spacing and not spacing <= grid.end:
        raise ShotError(
            "the knots would be farther apart than the shot is long",
            path=character.path,
            attribute="retarget.optimize.knot_spacing" if options.knot_spacing else "calm:retarget:knotSpacing",
            found=f"{spacing:g} s, where the shot lasts {grid.end:g} s",
            remedy="Use a shorter distance, or leave it out.",
        )
    if spacing:
        breaks = uniform_breaks(grid, spacing)
    else:
        breaks = breaks_for(grid, kept_ends, offsets, allowed) if np.any(offsets) else first_breaks(grid)
    basis = basis_on(grid, breaks, kept_ends)
    if not basis.count:
        raise ShotError(
            "the shot is too short to change anything between its kept end poses",
            path=character.path,
            attribute="calm:retarget:endpoints",
            found=settings.endpoints,
            remedy="Set it to free, or lengthen the shot to five frames or more.",
        )
    fixed = locked_coefficients(animation, basis, motors, grid.end)
    if not len(motors) or np.all(fixed):
        none = not character.motors
        raise ShotError(
            "the shot has no motors" if none else "every motor is locked, so there is nothing to optimise",
            path=character.path,
            attribute="" if none else "calm:motor:optimize",
            remedy="Drive its joints, as `calmotion import` does, or simulate it."
            if none
            else "Set it to true on the motors that may change.",
        )
    bounds = motor_bounds(character, np.any(coupling, axis=1))
    if options.limited_by_tempo:
        bounds = {name: bound for name, bound in bounds.items() if name not in TEMPO_LIMITS}
    bounds |= {name: bounds[name].narrowed(np.array(shares)) for name, shares in options.narrowed if name in bounds}
    continuous = options.adjoint == "continuous"
    if "effort" in bounds or grid.cyclic:
        refuse_continuous(options, character, "cyclic shots" if grid.cyclic else "limits of motor efforts")
    return Unknowns(basis, motors, coupling, offsets, fixed, bounds, continuous)


def existing_offsets(animation: Animation, grid: TimeGrid, motors: IntArray) -> Array:
    """The offsets that the shot already contains, shape [T, m]; zero when it contains none."""
    if animation.current is animation.tracks:
        return np.zeros((len(grid.times), len(motors)))
    intended, _ = sample_tracks([animation.tracks[k] for k in motors], grid)
    current, _ = sample_tracks([animation.current[k] for k in motors], grid)
    return current - intended


def locked_coefficients(animation: Animation, basis: OffsetBasis, motors: IntArray, end: float) -> BoolArray:
    """Which coefficients change a curve where the shot locks it, shape [P * m], by basis function, then motor.

    Args:
        end: Last frame of the shot [s].
    """
    fixed = np.zeros((basis.count, len(motors)), bool)
    first, last = basis.support.T
    column = {int(motor): k for k, motor in enumerate(motors)}
    for track in animation.free:
        if track.motor in column:
            for start, stop in track.locked(end):
                # functions of a cyclic shot that begin before its start also act at its end
                for late in (0.0, end) if basis.wraps else (0.0,):
                    fixed[(first + late < stop) & (last + late > start), column[track.motor]] = True
    return fixed.ravel()
