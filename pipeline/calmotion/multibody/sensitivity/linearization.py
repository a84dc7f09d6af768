"""The simulation linearised about a trajectory: blocks and factors of every instant, for the sweeps; compiled.

A perturbation at instant n is (R^T dc, dphi, du) of each component. With (dV, dtheta) following from it and the
earlier instants by the backward differences of `bdf2`, each step reads

    K z_n = -( P h_V + D h_A + r_theta dtheta_m + r_rate dtheta_m' )

with h_V, h_A the parts of dV, dV' that depend on earlier instants.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators.bdf2 import position_to_velocity, velocities
from calmotion.multibody.integrators.coefficients import bdf2_integrator
from calmotion.multibody.integrators.trajectory import Inputs, Trajectory, instant_of, instants_of
from calmotion.multibody.integrators.workspace import Scratch, Workspace
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.linear_solver.closed_chains import copy_rows, factor_closed_chains
from calmotion.multibody.linear_solver.elimination import factor
from calmotion.multibody.linear_solver.step_matrix import StepMatrix, matrix_at
from calmotion.multibody.model.phases import EULER, has_phases, phases_of
from calmotion.multibody.model.system import Blocks, Instants, Integrator, State, System
from calmotion.multibody.sensitivity.linearized_steps import (
    LinearizedSteps,
    allocate_steps,
    bytes_of_an_instant,
    steps_between,
)
from calmotion.multibody.statics.equilibrium import STATIC
from calmotion.multibody.statics.regularized_statics import regularize
from calmotion.support import operating_system
from calmotion.support.compilation import YES, inlined_kernel, kernel
from calmotion.support.memory import available_memory

MEMORY = 4e9  # upper limit of a linearisation [bytes]
SHARE = 0.5  # of the memory that is free
_FEW = 64  # instants of a thread at least


def processors() -> int:
    """Processors that this process may use."""
    return len(operating_system.processors())


@inlined_kernel
def _velocity_map(
    system: System, integrator: Integrator, continuous: bool, instants: Instants, scratch: Scratch, Hv: Array
) -> None:
    """Accelerations of an instant into the scratch, and the derivative of its velocities by positions into Hv."""
    velocities(system, integrator.h, instants, scratch.J, scratch.Vd)
    if continuous:
        for b in range(len(system.parent)):
            for i in range(4):
                for k in range(4):
                    Hv[b, i, k] = integrator.velocity if i == k else 0.0
    else:
        position_to_velocity(system, integrator.h, instants, scratch.T, scratch.Wt, Hv)


@kernel
def _keep_blocks(blocks: Blocks, matrix: StepMatrix, at: int, steps: LinearizedSteps) -> None:
    """Copies what the sweeps read of an instant's blocks to its matrix and to entry `at` of the steps."""
    for b in range(steps.P.shape[1]):
        copy_rows(blocks.P[b], steps.P[at, b])
        copy_rows(blocks.D[b], steps.D[at, b])
    for j in range(matrix.Lc.shape[0]):
        copy_rows(blocks.Lc[j], matrix.Lc[j])
        copy_rows(blocks.Lp[j], matrix.Lp[j])
        copy_rows(blocks.Hp[j], matrix.Hp[j])
        copy_rows(blocks.Nc[j], matrix.Nc[j])
        copy_rows(blocks.Jp[j], matrix.Jp[j])
    copy_rows(blocks.by_angle, steps.by_angle[at])
    copy_rows(blocks.by_rate, steps.by_rate[at])
    copy_rows(blocks.on_parent, steps.on_parent[at])
    copy_rows(blocks.on_rotor, steps.on_rotor[at])


@kernel
def _linearize(
    system: System, integrator: Integrator, continuous: bool, states: State, inputs: Inputs, first: int, last: int,
    restarts: int, ws: Workspace, steps: LinearizedSteps,
) -> tuple[int, int]:  # fmt: skip
    """Blocks and factors of instants first..last-1; returns -1 or the component that is singular, and the instant.

    Args:
        restarts: See `phases.Phase`; the integrator is that of these steps.
    """
    work, blocks, scratch = ws.work, ws.blocks, ws.scratch
    count, joints = len(system.parent), len(system.rows)
    for n in range(first, last):
        at = n - first
        now, Hv, matrix = instant_of(states, n), steps.Hv[at], matrix_at(steps.matrix, at)
        if n == 0:
            Hv[:] = 0.0
            scratch.Vd[:] = 0.0
        else:
            instants = instants_of(instant_of(states, 0), states, n)
            if restarts:
                scratch.kept.turn[:] = 0.0
                to = instants.before
                before = State(to.c, to.q, to.u, scratch.kept.turn, to.V, to.lam)
                instants = Instants(before, before, instants.now)
            _velocity_map(system, integrator, continuous, instants, scratch, Hv)
        copy_rows(inputs.world[n], work.world)
        kind = STATIC if n == 0 else integrator
        assemble(system, kind, now, scratch.Vd, inputs.angles[n], inputs.rates[n], Hv, YES, work, blocks)
        if n == 0:
            regularize(system, blocks.K, blocks.Lc, blocks.Nc)
        _keep_blocks(blocks, matrix, at, steps)
        bad = factor(system, blocks, matrix, scratch.solution.block)
        if bad >= 0:
            return bad, n
        if joints > count:
            for j in range(count, joints):
                copy_rows(blocks.Hc[j], matrix.Hc[j - count])
            factor_closed_chains(system, matrix, scratch.border)
        for b in range(count):
            copy_rows(work.R[b], steps.R[at, b])
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
        previous: A linearisation whose memory is used again if it has the same size (it becomes invalid).
        memory: Limit for blocks and factors [bytes]; None: by the free memory of the machine.
        continuous: For `continuous_adjoint`: a step's velocities follow its positions by 3/2h alone.
        begin: First instant whose equations are linearised: 0, the static start; 2 where two instants were given; or a
            later one where earlier inputs do not change, derivatives by which are then zero.

    Raises:
        SimulationFailure: A singular step, or one that had to be refined: its equations are not those of the others.
        ValueError: A simulation by another integrator than BDF2; contacts or switched motors, and the continuous
            adjoint.
    """
    if trajectory.integrator != "bdf2":
        raise ValueError("only BDF2 has derivatives")
    if continuous and has_phases(system):
        raise ValueError("the continuous adjoint supports neither contacts nor motors that are switched")
    if trajectory.refined:
        raise SimulationFailure(trajectory.refined[0] * trajectory.h, 0, Reason.REFINED)
    reused = 0 if previous is None else previous.size * bytes_of_an_instant(system)
    size = window_size(system, len(angles) - begin, spare_memory(reused) if memory is None else memory)
    steps = allocate_steps(system, size) if previous is None or previous.size != size else previous.steps
    made = Linearization(
        system, trajectory, Inputs(angles, rates, trajectory.world), workspace, steps, continuous, begin
    )
    if previous is not None:
        made._helpers = previous._helpers
    made.load(begin)
    return made


def spare_memory(reused: float = 0.0) -> float:
    """Memory for a linearisation [bytes]: a share of the free memory, at most `MEMORY`.

    Args:
        reused: Memory of an earlier linearisation that is used again [bytes].
    """
    return min(MEMORY, SHARE * (available_memory() + reused))


def window_size(system: System, instants: int, memory: float) -> int:
    """Number of instants whose blocks and factors fit into some memory [bytes], at least two."""
    return max(2, min(instants, int(min(memory, MEMORY) / bytes_of_an_instant(system))))


class Linearization:
    """The linearised equations of all instants, for the sweeps.

    Where all instants together would take too much memory, they are computed window by window in each sweep.
    """

    def __init__(
        self, system: System, trajectory: Trajectory, inputs: Inputs, workspace: Workspace, steps: LinearizedSteps,
        continuous: bool = False, begin: int = 0,
    ):  # fmt: skip
        self.continuous, self._begin = continuous, begin
        self.system, self.trajectory, self.inputs = system, trajectory, inputs
        self.workspace, self.steps = workspace, steps
        self._loaded = -1
        self._axes = np.zeros((0, len(system.rows), 3, 3))
        self._helpers: list[Workspace] = []  # one for each further processor

    @property
    def size(self) -> int:
        """Number of instants of a window."""
        return len(self.steps.P)

    def is_of(self, trajectory: Trajectory, begin: int) -> bool:
        """Whether it is that of a simulation from an instant on."""
        return self.trajectory is trajectory and self._begin == begin

    def axes(self, wanted: bool) -> Array:
        """Axes of the joints' parent-side markers where sliders need them for their efforts, shape [T, J, 3, 3]."""
        total, joints = self.inputs.angles.shape
        if len(self._axes) != total and wanted:
            self._axes = np.zeros((total, joints, 3, 3))
            if np.any(self.system.sliding):
                self._axes[:] = reactions(self.system, self.trajectory, self.inputs.angles, self.inputs.rates).axes
        return self._axes

    def windows(self) -> list[tuple[int, int]]:
        """First instant and the one after the last of every window."""
        total = len(self.inputs.angles)
        return [(first, min(first + self.size, total)) for first in range(self._begin, total, self.size)]

    def load(self, first: int) -> None:
        """Compute the window that starts at an instant, if it is not there.

        Raises:
            SimulationFailure: A singular step.
        """
        if first == self._loaded:
            return
        self._loaded = -1
        trajectory, h = self.trajectory, self.trajectory.h
        last = min(first + self.size, len(self.inputs.angles))

        def part(start: int, end: int, workspace: Workspace) -> tuple[int, int]:
            for phase in phases_of(self.system, trajectory.world, start, end):
                steps = steps_between(self.steps, slice(phase.first - first, phase.last - first))
                integrator = bdf2_integrator(EULER * h if phase.restarts else h)
                bad, instant = _linearize(
                    phase.system, integrator, self.continuous, trajectory.states, self.inputs, phase.first, phase.last,
                    phase.restarts, workspace, steps,
                )  # fmt: skip
                if bad >= 0:
                    return bad, instant
            return -1, 0

        # instants do not depend on each other, and kernels run without the interpreter's lock
        share = max(_FEW, math.ceil((last - first) / processors()))
        starts = range(first, last, share)
        while len(self._helpers) < len(starts) - 1:
            self._helpers.append(Workspace.for_system(self.system))
        with ThreadPoolExecutor(max(1, len(self._helpers))) as pool:
            others = [
                pool.submit(part, start, min(start + share, last), workspace)
                for start, workspace in zip(starts[1:], self._helpers, strict=False)
            ]
            results = [part(first, min(first + share, last), self.workspace), *(other.result() for other in others)]
        for bad, instant in results:
            if bad >= 0:
                raise SimulationFailure(instant * trajectory.h, bad, Reason.SINGULAR)
        self._loaded = first
