"""Parts of a shot in time: grid, curves and intended motion within some frames; simulations that are joined again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from calmotion.arrays import Array
from calmotion.model import Motion, Simulation
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.retargeting.windows.continued import Beginning, ContinuedSimulator
from calmotion.simulation.forward import ForwardRun, run_forward
from calmotion.simulation.inputs.curves import Curves
from calmotion.simulation.inputs.excerpts import later
from calmotion.simulation.inputs.time_grid import ORDERS, TimeGrid, after_knots, over_grid
from calmotion.simulation.preparation import Prepared
from calmotion.simulation.report import at_instants, simulation_of
from calmotion.simulation.target_errors import IntendedMotion


@dataclass(frozen=True, eq=False)
class Part:
    """The part of a shot between two frames, with the instants before it that must be known.

    Attributes:
        prepared: The part as a shot of its own, times from its first frame on.
        rows: Its instants among those of the shot.
        first: Its first frame.
    """

    prepared: Prepared
    rows: slice
    first: int

    @property
    def known(self) -> int:
        """How many of its instants are known: none of the first part."""
        grid = self.prepared.grid
        return grid.pre_steps + 1 if grid.joined else 0

    def curves_of(self, curves: Curves) -> Curves:
        """The part of curves of the whole shot."""
        return Curves(tuple(part[self.rows] for part in curves.derivatives))

    def intended_of(self, intended: IntendedMotion) -> IntendedMotion:
        """The part of an intended motion of the whole shot."""
        parts = (intended.c, intended.q, intended.target_positions, intended.target_rotations)
        return IntendedMotion(*(part[self.rows] for part in parts))


def part_of(whole: Prepared, first: int, last: int, known: int, ends: bool = False) -> Part:
    """The part between two frames of a shot.

    Args:
        first, last: Frames.
        known: Number of known instants up to the first frame, where the part does not begin the shot.
        ends: Whether offsets may end in it as at the end of a shot, though the shot goes on.
    """
    grid = whole.grid
    joined = first > 0
    pre = known - 1 if joined else grid.pre_steps
    start = grid.pre_steps + grid.substeps * first - pre
    stop = grid.pre_steps + grid.substeps * last + 1
    times = grid.frame_times[: last - first + 1]
    own = TimeGrid(
        times, grid.substeps, pre, grid.h, joined=joined, continues=not ends and last < len(grid.frame_times) - 1
    )
    animation = later(whole.shot.animation, float(grid.frame_times[first]), times)
    shot = replace(whole.shot, animation=animation)
    rows = slice(start, stop)
    return Part(Prepared(shot, own, whole.world[rows]), rows, first)


def offset_curves(offsets: Array, grid: TimeGrid) -> Curves:
    """Offsets of all motors at all instants of a shot.

    Args:
        offsets: At the frames, shape [f, M]: splines whose knots lie on frames, which the frames hold exactly.
        grid: Of the shot.
    """
    if not offsets.shape[1] or not np.any(offsets):
        return Curves.zero(len(grid.times), offsets.shape[1])
    return Curves(over_grid(grid, _sampling(offsets, grid)))


def offsets_in(part: Part, offsets: Array, grid: TimeGrid) -> Curves:
    """`Part.curves_of` those of `offset_curves`, which are sampled in the part alone.

    Args:
        offsets: Of the shot, at its frames, shape [f, M].
        grid: Of the shot.
    """
    times = grid.times[part.rows]
    if not offsets.shape[1] or not np.any(offsets):
        return Curves.zero(len(times), offsets.shape[1])
    sample = _sampling(offsets, grid)
    if not part.first:  # with a pre-roll, perhaps
        return Curves(over_grid(part.prepared.grid, sample))
    return Curves(tuple(sample(after_knots(times, order, grid.h), order) for order in range(ORDERS)))


def _sampling(offsets: Array, grid: TimeGrid) -> Callable[[Array, int], Array]:
    """Offsets and their derivatives by time [s]."""
    spline = CubicSpline(grid.frame_times, offsets, bc_type="not-a-knot")
    end = grid.end

    def sample(times: Array, order: int) -> Array:
        return np.asarray(spline(np.clip(times, 0.0, end), order))

    return sample


def performed(part: Part, curves: Curves, beginning: Beginning | None) -> ForwardRun:
    """A simulation of a part.

    Args:
        curves: Of its motors at its instants.
        beginning: The known states; None for the part that begins the shot.
    """
    prepared = part.prepared
    if beginning is None:
        workspace = Workspace.for_system(prepared.model.system)
        return run_forward(prepared.model, workspace, curves.angles, curves.rates, prepared.grid.h, prepared.world)
    simulator = ContinuedSimulator(prepared.model, prepared.grid.h, prepared.world, beginning)
    return simulator.run(curves.angles, curves.rates)


@dataclass(frozen=True, eq=False)
class Piece:
    """A simulated part, without its known instants; `time` is that of its first frame [s]."""

    simulation: Simulation
    time: float


def piece_of(part: Part, run: ForwardRun, intended: IntendedMotion) -> Piece:
    """A run of a part as a value for the user."""
    whole, rows = simulation_of(part.prepared, run, part.intended_of(intended)), slice(part.known, None)
    known = part.prepared.grid.times[part.known] if part.known else -np.inf
    simulation = replace(at_instants(whole, rows), dead_centres=whole.dead_centres[whole.dead_centres >= known])
    return Piece(simulation, float(part.first * (part.prepared.grid.frame_times[1])))


_NO = np.zeros(0)
_NOTHING = Motion(_NO, _NO, _NO, (), _NO, _NO, _NO, _NO)


def joined(pieces: list[Piece], times: Array) -> Simulation:
    """Successive pieces as one simulation.

    Args:
        pieces: They are taken: nobody else needs their motions beside it.
        times: Of all instants [s], shape [T].
    """
    starts, parts = [piece.time for piece in pieces], [piece.simulation for piece in pieces]
    pieces.clear()
    # each array of a piece is let go when it is in that of the shot: both together would be the most that a show takes
    motions = [vars(part.motion) | {"elastic": list(part.motion.elastic)} for part in parts]
    parts = [replace(part, motion=_NOTHING) for part in parts]

    def whole(name: str) -> Array:
        return np.concatenate([motion.pop(name) for motion in motions])

    def forces(name: str) -> Array | None:
        return None if motions[0][name] is None else whole(name)

    bodies = range(len(motions[0]["elastic"]))
    motion = Motion(
        times, whole("positions"), whole("rotations"),
        tuple(np.concatenate([each["elastic"].pop(0) for each in motions]) for _ in bodies),
        whole("motor_values"), whole("motor_efforts"), whole("target_positions"), whole("target_rotations"),
        forces("joint_forces"), forces("joint_moments"),
    )  # fmt: skip
    return Simulation(
        motion=motion,
        position_errors=np.concatenate([part.position_errors for part in parts]),
        rotation_errors=np.concatenate([part.rotation_errors for part in parts]),
        newton_iterations=sum(part.newton_iterations for part in parts),
        max_joint_gap=max(part.max_joint_gap for part in parts),
        wall_s=sum(part.wall_s for part in parts),
        sag=parts[0].sag,
        refined_steps=sum(part.refined_steps for part in parts),
        dead_centres=np.concatenate([part.dead_centres + start for part, start in zip(parts, starts, strict=True)]),
    )
