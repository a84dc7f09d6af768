"""The error of the time step at the targets and in the joints, from simulations of the same curves by two steps."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, IntArray
from calmotion.errors import IntegrationError
from calmotion.model import Character, Result
from calmotion.model.character import contact_joints
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.forward import ForwardRun, reactions_at, run_forward
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.inputs.open_chains import open_joints
from calmotion.simulation.preparation import Prepared, failure_error, prepare
from calmotion.simulation.report import elastic_by_body
from calmotion.simulation.rigid_run import excitation_of
from calmotion.tolerance.integrator_choice import SAFE

CLOSED_GAP = 1e-6  # largest position gap of a joint that counts as none [m]
ORDER = 2  # of BDF2; the global error goes with this power of the step
ORDER_AT_IMPACTS = 1  # a change of contacts excites vibration that no step resolves, as sharply as steps allow
SAME_GAP = 0.01  # differences of a gap by three steps, of the gap: less than those of any gap that steps cause
MARGIN, WORTH = 0.9, 1.1  # of a step between two that were tried; how much longer it must be than the shorter of them


@dataclass(frozen=True, eq=False)
class StepRun:
    """Where one simulation has the targets at the shot's frames.

    Attributes:
        step: [s].
        positions: [m], shape [f, K, 3]; infinite where the simulation failed.
        elastic: Elastic coordinates of each body of the character at every step, shape [T, r], of single precision: of
            a long shot they take most of the memory; empty where nobody asked for them.
        integrator: By which it was simulated; empty where that does not matter.
        gap: Largest position gap of a joint at any step [m].
        efforts: Of the motors [N m] or [N], shape [f, M]; None where they are not known.
        order: With which power of the step its error goes.
        loads: On each body of the character; empty where nobody asked for them.
    """

    step: float
    positions: Array
    elastic: tuple[NDArray[np.float32], ...] = ()
    integrator: str = ""
    gap: float = 0.0
    efforts: Array | None = None
    order: int = ORDER
    loads: tuple[LoadEnvelope, ...] = ()


def order_of(character: Character) -> int:
    """With which power of the step the error of a simulation goes: the first where contacts come and go."""
    contacts = [character.joints[joint].contact for joint in contact_joints(character)]
    switched = any(contact is not None and contact.changes for contact in contacts)
    return ORDER_AT_IMPACTS if switched else ORDER


def simulate_at(
    shot: CompiledShot, options: RunSettings, step: float, elastic: bool = False, divides: bool = True,
    loads: bool = False,
) -> StepRun:  # fmt: skip
    """One simulation of a shot's current curves.

    Args:
        step: [s].
        elastic: Whether the elastic coordinates are wanted.
        divides: Whether a step that cannot be solved is divided into smaller ones, where the shot does not loop.
        loads: Whether the loads on the bodies are wanted.

    Raises:
        ShotError: The shot cannot be simulated by this step.
    """
    prepared, run = _performed(shot, options, step, divides)
    model, grid = prepared.model, prepared.grid
    parts = elastic_by_body(model, run.trajectory.states.u) if elastic else []
    return StepRun(
        grid.h, run.target_positions[grid.frames], tuple(part.astype(np.float32) for part in parts), options.scheme,
        run.trajectory.max_joint_gap, _efforts(prepared, run, grid.frames), order_of(shot.character),
        excitation_of(shot.character, model, run, grid.h) if loads else (),
    )  # fmt: skip


def efforts_by(shot: CompiledShot, options: RunSettings, step: float) -> Array:
    """Efforts of the motors at the judged instants of one simulation [N m] or [N], shape [T, M]; as `simulate_at`."""
    prepared, run = _performed(shot, options, step, True)
    return _efforts(prepared, run, np.flatnonzero(prepared.grid.judged).astype(np.int32))


def _performed(shot: CompiledShot, options: RunSettings, step: float, divides: bool) -> tuple[Prepared, ForwardRun]:
    prepared = prepare(shot, replace(options, step=step))
    model, grid = prepared.model, prepared.grid
    workspace = Workspace.for_system(model.system)
    angles, rates = sample_tracks(shot.animation.current, grid)
    steady = SteadyState(model, prepared.world, grid.h, workspace) if grid.cyclic else None
    try:
        run = run_forward(
            model, workspace, angles, rates, grid.h, prepared.world, None, options.scheme, steady, divides
        )  # fmt: skip
    except SimulationFailure as failure:
        raise failure_error(prepared, failure) from failure
    return prepared, run


def _efforts(prepared: Prepared, run: ForwardRun, frames: IntArray) -> Array:
    """Efforts of the motors at some instants [N m] or [N], shape [f, M]."""
    return prepared.model.motor_efforts(reactions_at(prepared.model, run, frames).efforts)


def frames_of_result(result: Result, frame_times: Array) -> StepRun:
    """The motion of a result that counts, at the frames [s]."""
    motion = (result.after or result.before).motion
    # times are sums of steps, so a frame may come out a rounding later
    rows = np.searchsorted(motion.times, frame_times - 1e-9)
    return StepRun(result.step_s, motion.target_positions[rows], efforts=motion.motor_efforts[rows])


def distance(one: Array, other: Array) -> float:
    """Largest distance of any target at any frame [m], between places of shape [f, K, 3]."""
    return float(np.max(np.linalg.norm(one - other, axis=2), initial=0.0))


def step_error(coarse: StepRun, fine: StepRun, order: float | None = None) -> float:
    """Error of the finer of two runs at any target [m], by Richardson's extrapolation.

    Args:
        order: With which power of the step it goes; None: the order of the integrator.
    """
    ratio = (coarse.step / fine.step) ** (_order(coarse, fine) if order is None else order) - 1.0
    return distance(coarse.positions, fine.positions) / ratio


def effort_errors(run: StepRun, other: StepRun) -> Array | None:
    """Error of each motor's effort by the step of a run [N m] or [N], shape [M], from a run by another step.

    The error is taken to go with the step itself: multipliers converge more slowly than positions, and may oscillate
    from step to step.
    """
    if run.efforts is None or other.efforts is None or not 0.0 < other.step != run.step:
        return None
    apart = np.max(np.abs(run.efforts - other.efforts), axis=0, initial=0.0)
    return np.asarray(apart / abs(other.step / run.step - 1.0))


def step_gaps(coarse: StepRun, fine: StepRun) -> tuple[float, float]:
    """The part of the largest joint gap of two runs that their steps cause [m].

    The rest is that of closed chains whose joints do not fit together exactly: no step closes it.
    """
    ratio = (coarse.step / fine.step) ** _order(coarse, fine) - 1.0
    by_fine = min(fine.gap, max(0.0, coarse.gap - fine.gap) / ratio)
    return max(0.0, coarse.gap - (fine.gap - by_fine)), by_fine


def largest_step(
    run: Callable[[float], StepRun], first: float, last: float, allowed: Callable[[StepRun], float],
    refused_gap: float = np.inf,
) -> tuple[float, float]:  # fmt: skip
    """The largest step whose error is allowed and which keeps joints closed: by halving the first, and then between
    two of these by the order that three of them show.

    A robot whose motors determine its motion has its targets where they should be by any step, so that their error does
    not tell that velocities and forces oscillate from step to step; the joints, which the faster integrators hold
    together in velocity, come apart there.

    Args:
        run: Simulates by a step [s]; may raise IntegrationError where that is too large.
        first, last: Steps to begin and to end with [s].
        allowed: Error at the targets [m] that may be, from the finest run so far.
        refused_gap: Position gap of a joint above which the simulation by the step that is found is refused [m].

    Returns:
        The step [s] and its estimated error [m]; where not even the last is fine enough, that and its error, and where
        no step closes the joints, the first that shows it.

    Raises:
        IntegrationError: Joints come apart by a step half as long as the error allows: the safe integrator, which
            keeps them closed, needs no more steps than this one then.
    """
    step, coarse, before = first, run_or_none(run, first), None
    while True:
        step *= 0.5
        fine = run_or_none(run, step)
        if fine is None:
            if step <= last:
                return step, np.inf
        elif coarse is not None and coarse.step > fine.step:  # a frame may be shorter than both
            enough = allowed(fine)
            if before is None and step_error(coarse, fine) <= enough:
                before = run_or_none(run, 2.0 * coarse.step)  # the cheapest way to see the order
            order = observed_order(before, coarse, fine)
            error = step_error(coarse, fine, order)
            by_coarse = (coarse.step / fine.step) ** order * error
            coarse_closed, fine_closed = (gap <= CLOSED_GAP for gap in step_gaps(coarse, fine))
            if by_coarse <= enough and coarse_closed:
                return coarse.step, by_coarse
            if error <= enough and fine_closed:
                # between the two the gap is not known
                return between(fine, error, enough, order) if coarse_closed else (fine.step, error)
            if by_coarse <= enough and fine.integrator not in ("", SAFE):
                raise open_joints(fine.gap, fine.integrator, fine.step)
            if step <= last or no_step_closes(before, coarse, fine, refused_gap):
                return fine.step, error
            before = coarse
        elif step <= last:
            return fine.step, np.inf
        coarse = fine


def no_step_closes(before: StepRun | None, coarse: StepRun, fine: StepRun, refused_gap: float) -> bool:
    """Whether joints stay open by more than is allowed, whatever the step: motors of a closed chain contradict each
    other, or its links do not fit together.

    Gaps that steps cause fall at least with the step, and those of steps by which the motion is not resolved differ
    from each other: three that hardly differ, over two successive shorter steps, are of neither kind.

    Args:
        before: A run by a longer step than the coarse one; None: not known.
        refused_gap: Largest that is allowed [m].
    """
    if before is None or not before.step > coarse.step > fine.step:
        return False
    gaps = (before.gap, coarse.gap, fine.gap)
    return min(gaps) > refused_gap and max(gaps) - min(gaps) <= SAME_GAP * fine.gap


def observed_order(before: StepRun | None, coarse: StepRun, fine: StepRun) -> float:
    """With which power of the step the error goes, between one and the order of the integrator.

    Steps that do not resolve a vibration have errors that hardly depend on them: the two differ by less than the
    integrator's order tells then, and an error that follows from this order is several times too small. The same
    difference between longer steps shows it.

    Args:
        before: A run by a longer step than the coarse one; None: the order of the integrator is taken.

    Source: Roache 1998, Verification and Validation in Computational Science and Engineering, 5.10 (observed order).
    """
    most = float(_order(coarse, fine))
    if before is None or not before.step > coarse.step > fine.step:
        return most
    longer, apart = distance(before.positions, coarse.positions), distance(coarse.positions, fine.positions)
    r, q = before.step / coarse.step, coarse.step / fine.step

    def ratio(order: float) -> float:
        """Of the two distances, by an order."""
        return float(q**order * (r**order - 1.0) / (q**order - 1.0))

    orders = np.linspace(1.0, most, 51)
    return float(np.interp(longer, [apart * ratio(order) for order in orders], orders)) if apart > 0.0 else most


def between(fine: StepRun, error: float, enough: float, order: float) -> tuple[float, float]:
    """A step [s] up to twice as long as that of a run whose error is allowed, and its error [m].

    Args:
        fine: The run.
        error: Of it [m].
        enough: What is allowed [m].
        order: With which power of the step it goes.
    """
    longer = MARGIN * (min(2.0, (enough / error) ** (1.0 / order)) if error > 0.0 else 2.0)
    if longer <= WORTH:
        return fine.step, error
    return longer * fine.step, longer**order * error


def _order(one: StepRun, other: StepRun) -> int:
    """Of two runs of a shot, one of which may not know it."""
    return min(one.order, other.order)


def run_or_none(run: Callable[[float], StepRun], step: float) -> StepRun | None:
    """The run by a step, None where that step fails.

    Raises:
        ShotError: The shot cannot be simulated by any step.
    """
    try:
        return run(step)
    except IntegrationError:
        return None
