"""The simulation linearised about a trajectory: blocks and factors of every instant, for `sweeps`; compiled.

A perturbation at instant n is (R^T dc, dphi, du) of each component. With (dV, dtheta) following from it and the
earlier instants by the backward differences of `bdf2`, each step reads

    K z_n = -( P h_V + D h_A + r_theta dtheta_m + r_rate dtheta_m' )

with h_V, h_A the part of dV, dV' that earlier instants determine.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.bdf2 import position_to_velocity, velocities
from calmotion.multibody.integrators.schemes import bdf2_scheme
from calmotion.multibody.integrators.trajectory import Trajectory, instant_of
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.linear_solver.closed_chains import UNKNOWNS, copy_rows, factor_loops
from calmotion.multibody.linear_solver.elimination import factor
from calmotion.multibody.model.system import JOINT_ROWS, Blocks, System
from calmotion.multibody.statics.equilibrium import STATIC
from calmotion.multibody.statics.regularized_statics import hold
from calmotion.shot.character import Array, IntArray
from calmotion.support.compilation import YES, kernel
from calmotion.support.memory import available_memory

MEMORY = 4e9  # most that a linearisation takes [bytes]
SHARE = 0.5  # of the memory that is free
_FEW = 64  # instants that are not worth another thread


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@kernel
def _linearize(
    system, static, scheme, continuous, h, states, angles, rates, world, first, last, work, blocks, scratch, data,
    pivots,
):  # fmt: skip
    """Blocks and factors of instants first..last-1; returns -1 or the component that is singular, and the instant."""
    J, T, Wt, Vd, block, border = scratch.J, scratch.T, scratch.Wt, scratch.Vd, scratch.block, scratch.border
    P, D, Lc, Lp, Hc, Hp, Nc, Jp, by_angle, by_rate, on_parent, lu, Z, inverse, R, Hv = data
    count, size = Vd.shape
    joints = len(system.rows)
    for n in range(first, last):
        at = n - first
        now = instant_of(states, n)
        if n == 0:
            for b in range(count):
                for i in range(4):
                    for k in range(4):
                        Hv[0, b, i, k] = 0.0
                for i in range(size):
                    Vd[b, i] = 0.0
        else:
            before = instant_of(states, n - 1)
            before2 = instant_of(states, max(n - 2, 0))
            velocities(system, h, now, before, before2, J, Vd)
            if continuous:
                for b in range(count):
                    for i in range(4):
                        for k in range(4):
                            Hv[at, b, i, k] = scheme.velocity if i == k else 0.0
            else:
                position_to_velocity(system, h, now, before, J, T, Wt, Hv[at])
        copy_rows(world[n], work.world)
        # the sweeps read these in place, so they are made there
        here = Blocks(
            blocks.K, P[at], D[at], Lc[at], Lp[at], blocks.Hc, Hp[at], Nc[at], Jp[at], by_angle[at], by_rate[at],
            on_parent[at], blocks.res, blocks.gap,
        )  # fmt: skip
        kind = static if n == 0 else scheme
        assemble(
            system, kind, now.c, now.q, now.u, now.V, Vd, now.lam, angles[n], rates[n], Hv[at], YES, work, here
        )  # fmt: skip
        if n == 0:
            hold(system, here.D, here.K, here.Nc)
        bad = factor(system, here, lu[at], pivots[at], Z[at], block)
        if bad >= 0:
            return bad, n
        if joints > count:
            for j in range(count, joints):
                copy_rows(blocks.Hc[j], Hc[at, j - count])
            factor_loops(
                system, Lc[at], Lp[at], Hc[at], Hp[at], Nc[at], Jp[at], lu[at], pivots[at], Z[at], border, block
            )
            copy_rows(border.inverse, inverse[at])
        for b in range(count):
            for i in range(3):
                for k in range(3):
                    R[at, b, i, k] = work.R[b, i, k]
    return -1, 0


def linearize(
    system: System,
    trajectory: Trajectory,
    angles: Array,
    rates: Array,
    workspace: Workspace,
    previous: Linearization | None = None,
    memory: float | None = None,
    continuous: bool = False,
    begin: int = 0,
) -> Linearization:
    """Linearise a simulation about its trajectory.

    Args:
        angles, rates: The joint angles (or lengths) and rates it was simulated with, shape [T, J].
        previous: A linearisation of the same size whose memory is used again (it becomes invalid).
        memory: Most that blocks and factors may take [bytes]; None: what the machine has to spare.
        continuous: For `continuous_adjoint`: a step's velocities follow its positions by 3/2h alone.
        begin: First instant whose equations count: 0, the static start, 2 where two instants were given, or one before
            which nothing changes; derivatives by what acts before it are then zero.

    Raises:
        SimulationFailure: A singular step, or one that had to be refined: its equations are not those of the others.
        ValueError: A simulation by another integrator than BDF2, whose sweeps these are.
    """  # fmt: skip
    if trajectory.integrator != "bdf2":
        raise ValueError("sweeps are those of BDF2")
    if trajectory.refined:
        raise SimulationFailure(trajectory.refined[0] * trajectory.h, 0, "refined")
    held = 0 if previous is None else len(previous.pivots) * bytes_of_an_instant(system)
    size = window_size(system, len(angles) - begin, spare_memory(held) if memory is None else memory)
    if previous is not None and len(previous.pivots) == size:
        data, pivots = previous.data, previous.pivots
    else:
        data = tuple(np.zeros((size, *shape)) for shape in _shapes(system))
        pivots = np.zeros((size, len(system.parent), system.size + JOINT_ROWS), np.int32)
    made = Linearization(system, trajectory, angles, rates, workspace, data, pivots, continuous, begin)
    if previous is not None:
        made._helpers = previous._helpers
    made.load(begin)
    return made


def _shapes(system: System) -> list[tuple[int, ...]]:
    """Shapes of what is kept of an instant, in the order of `Linearization.data`."""
    count, size, joints, m = len(system.parent), system.size, len(system.rows), JOINT_ROWS
    loops = joints - count
    border = UNKNOWNS * loops
    return [
        (count, size, size), (count, size, size), (joints, size, m), (joints, size, m), (loops, m, size),
        (joints, m, size), (joints, size, 3), (joints, 3, size), (joints, m), (joints, m), (joints, size),
        (count, size + m, size + m), (count, size + m, m), (border, border), (count, 3, 3), (count, 4, 4),
    ]  # fmt: skip


def spare_memory(held: float = 0.0) -> float:
    """What a linearisation may take [bytes]: a share of the memory that is free, at most `MEMORY`.

    Args:
        held: Of it, what an earlier linearisation has that is used again [bytes].
    """
    return min(MEMORY, SHARE * (available_memory() + held))


def window_size(system: System, instants: int, memory: float) -> int:
    """Number of instants whose blocks and factors fit into some memory [bytes], at least two."""
    return max(2, min(instants, int(min(memory, MEMORY) / bytes_of_an_instant(system))))


def bytes_of_an_instant(system: System) -> int:
    """What is kept of an instant takes so much memory."""
    return 8 * sum(int(np.prod(shape)) for shape in _shapes(system))


class Linearization:
    """What the sweeps need of every instant: blocks of `system.Blocks`, factors, rotations, velocity maps.

    Where all instants together would take too much memory they are made window by window, anew in each sweep.
    """

    def __init__(
        self, system: System, trajectory: Trajectory, angles: Array, rates: Array, workspace: Workspace,
        data: tuple[Array, ...], pivots: IntArray, continuous: bool = False, begin: int = 0,
    ):  # fmt: skip
        self.continuous, self._begin = continuous, begin
        self.system, self.trajectory, self.angles, self.rates = system, trajectory, angles, rates
        self.workspace, self.data, self.pivots = workspace, data, pivots
        self._loaded = -1
        self._axes = np.zeros((0, len(system.rows), 3, 3))
        self._helpers: list[Workspace] = []  # one for each further processor

    def is_of(self, trajectory: Trajectory, begin: int) -> bool:
        """Whether it is that of a simulation from an instant on."""
        return self.trajectory is trajectory and self._begin == begin

    def axes(self, wanted: bool) -> Array:
        """Axes of the joints' parent-side markers where sliders need them for their efforts, shape [T, J, 3, 3]."""
        total, joints = self.angles.shape
        if len(self._axes) != total and wanted:
            self._axes = np.zeros((total, joints, 3, 3))
            if np.any(self.system.sliding):
                self._axes[:] = reactions(self.system, self.trajectory, self.angles, self.rates).axes
        return self._axes

    def windows(self) -> list[tuple[int, int]]:
        """First instant and the one after the last of every window."""
        total, size = len(self.angles), len(self.pivots)
        return [(first, min(first + size, total)) for first in range(self._begin, total, size)]

    def load(self, first: int) -> None:
        """Make the blocks of the window that starts at an instant, if they are not there.

        Raises:
            SimulationFailure: A singular step.
        """
        if first == self._loaded:
            return
        self._loaded = -1
        trajectory, ws = self.trajectory, self.workspace
        last = min(first + len(self.pivots), len(self.angles))

        def part(start: int, end: int, own: Workspace) -> tuple[int, int]:
            here = slice(start - first, end - first)
            return _linearize(
                self.system, STATIC, bdf2_scheme(trajectory.h), self.continuous, trajectory.h, trajectory.states,
                self.angles, self.rates, trajectory.world, start, end, own.work, own.blocks, own.scratch,
                tuple(array[here] for array in self.data), self.pivots[here],
            )  # fmt: skip

        # instants do not depend on each other, and kernels run without the interpreter's lock
        share = max(_FEW, math.ceil((last - first) / processors()))
        starts = range(first, last, share)
        while len(self._helpers) < len(starts) - 1:
            self._helpers.append(Workspace.for_system(self.system))
        with ThreadPoolExecutor(max(1, len(self._helpers))) as pool:
            others = [
                pool.submit(part, start, min(start + share, last), own)
                for start, own in zip(starts[1:], self._helpers, strict=False)
            ]
            found = [part(first, min(first + share, last), ws), *(other.result() for other in others)]
        for bad, instant in found:
            if bad >= 0:
                raise SimulationFailure(instant * trajectory.h, bad, "singular")
        self._loaded = first
