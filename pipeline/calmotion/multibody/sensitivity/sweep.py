"""Windows of instants, efforts and motors in sweeps: the common part of tangent and adjoints; compiled."""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.kernels.sliders import has_row
from calmotion.multibody.linear_solver.step_matrix import SolutionScratch, allocate_solution
from calmotion.multibody.model.phases import EULER, phases_of
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.multibody.sensitivity.linearization import Linearization
from calmotion.multibody.sensitivity.linearized_steps import LinearizedSteps, steps_between
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import kernel


@by_reference
class Window(NamedTuple):
    """Linearised equations of instants first..last-1.

    Attributes:
        h: Time step [s]; of the first steps after a change of contacts 3/2 of it, see `phases`.
        restarts: 1 where steps do not reach back over the instant before them, else 0.
        turn, lam: Of the trajectory, see `State`; all instants.
        axes: Axes of the joints' parent-side markers, shape [T, J, 3, 3]; empty where no efforts are needed.
        steps: Of these instants alone.
    """

    first: int
    last: int
    h: float
    restarts: int
    turn: Array
    lam: Array
    axes: Array
    steps: LinearizedSteps


@by_reference
class SweepMemory(NamedTuple):
    """Perturbations of a motion that later steps read, or derivatives by them.

    Attributes:
        shift: Translations in world axes, shape [n, B, 3].
        velocity: Velocities, shape [n, B, N].
        turn: Rotation vectors from the previous instant, shape [n, B, 3].
    """

    shift: Array
    velocity: Array
    turn: Array


@by_reference
class SweepScratch(NamedTuple):
    """Scratch of a sweep.

    Attributes:
        x, lam: Right-hand side and solution of a step, shapes [B, N] and [J, 6].
        hV, hA: Parts of velocities and accelerations that depend on earlier instants, shape [B, N].
        tmp, J: Shapes [3] and [3, 3].
        solution: Scratch of the linear system.
    """

    x: Array
    lam: Array
    hV: Array
    hA: Array
    tmp: Array
    J: Array
    solution: SolutionScratch


def allocate_memory(system: System, instants: int) -> SweepMemory:
    """Zeroed memory of so many instants."""
    count = len(system.parent)
    shift, turn = np.zeros((instants, count, 3)), np.zeros((instants, count, 3))
    return SweepMemory(shift, np.zeros((instants, count, system.size)), turn)


def allocate_sweep(system: System) -> SweepScratch:
    """Scratch for one system."""
    shape = (len(system.parent), system.size)
    return SweepScratch(
        x=np.zeros(shape),
        lam=np.zeros((len(system.rows), JOINT_ROWS)),
        hV=np.zeros(shape),
        hA=np.zeros(shape),
        tmp=np.zeros(3),
        J=np.zeros((3, 3)),
        solution=allocate_solution(system),
    )


def window_of(lin: Linearization, first: int, last: int, efforts: bool) -> Window:
    """A window, computed if it is not there."""
    lin.load(first)
    states = lin.trajectory.states
    return Window(first, last, lin.trajectory.h, 0, states.turn, states.lam, lin.axes(efforts), lin.steps)


def parts_of(lin: Linearization, first: int, last: int, efforts: bool) -> list[tuple[System, Window]]:
    """A window by the phases in it, each with its system; computed if it is not there."""
    whole, found = window_of(lin, first, last, efforts), []
    for phase in phases_of(lin.system, lin.trajectory.world, first, last):
        steps = steps_between(lin.steps, slice(phase.first - first, phase.last - first))
        h = EULER * whole.h if phase.restarts else whole.h
        part = whole._replace(first=phase.first, last=phase.last, h=h, restarts=phase.restarts, steps=steps)
        found.append((phase.system, part))
    return found


@kernel
def effort_tangent(system: System, j: int, axes: Array, lam_of: Array, Jp: Array, x: Array, lam: Array) -> float:
    """Change of what a driven joint transmits along its axis by the coordinates x and the multipliers lam; 0 for other
    joints. It is the motor's effort but for servos, which turn their rotors as well and limit their efforts themselves.

    Args:
        axes, lam_of: Axes of the joints' parent-side markers, shape [J, 3, 3], and multipliers of the motion.
    """
    if system.rows[j] < JOINT_ROWS:
        return 0.0
    if not system.sliding[j]:
        moment: float = lam[j, 5]
        return moment
    t: float = axes[j, 0, 2] * lam[j, 0] + axes[j, 1, 2] * lam[j, 1] + axes[j, 2, 2] * lam[j, 2]
    p = system.side[j, 0]
    if p >= 0:
        # the axis rotates with the marker: (turn x z) . f = turn_y f_x - turn_x f_y in marker axes
        fx, fy = _transverse_force(axes, lam_of, j)
        for a in range(6 + system.elastic[p]):
            t += (Jp[j, 1, a] * fx - Jp[j, 0, a] * fy) * x[p, a]
    return t


@kernel
def effort_adjoint(
    system: System, j: int, axes: Array, lam_of: Array, Jp: Array, bar: float, x: Array, lam: Array
) -> None:
    """Transpose of `effort_tangent`: adds to x and lam."""
    if system.rows[j] < JOINT_ROWS:
        return
    if not system.sliding[j]:
        lam[j, 5] += bar
        return
    for i in range(3):
        lam[j, i] += axes[j, i, 2] * bar
    p = system.side[j, 0]
    if p >= 0:
        fx, fy = _transverse_force(axes, lam_of, j)
        for a in range(6 + system.elastic[p]):
            x[p, a] += (Jp[j, 1, a] * fx - Jp[j, 0, a] * fy) * bar


@kernel
def _transverse_force(axes: Array, lam: Array, j: int) -> tuple[float, float]:
    """Components of a joint's force along the first two axes of its parent-side marker."""
    fx = 0.0
    fy = 0.0
    for i in range(3):
        fx += axes[j, i, 0] * lam[j, i]
        fy += axes[j, i, 1] * lam[j, i]
    return fx, fy


@kernel
def motor_gradient(
    system: System, steps: LinearizedSteps, at: int, weight: float, x: Array, lam: Array, g_angle: Array,
    g_rate: Array,
) -> None:  # fmt: skip
    """Derivatives by angle and rate of each motor, shape [J], from the solution of a transposed step: minus a weight
    times the products with its equations' derivatives by them.

    Args:
        at: The step's place among the linearised ones.
    """
    for j in range(len(system.rows)):
        p = system.side[j, 0]
        ga = 0.0
        gr = 0.0
        for i in range(6):
            ga -= steps.by_angle[at, j, i] * lam[j, i]
            gr -= steps.by_rate[at, j, i] * lam[j, i]
        if p >= 0 and system.sliding[j]:
            for i in range(6 + system.elastic[p]):
                ga -= steps.on_parent[at, j, i] * x[p, i]
        if system.rotor[j] >= 0:
            moved = x[system.side[j, 1], 6 + system.rotor[j]]
            ga -= steps.on_rotor[at, j, 0] * moved
            gr -= steps.on_rotor[at, j, 1] * moved
        g_angle[j] = weight * ga
        g_rate[j] = weight * gr


@kernel
def add_constraint_velocities(system: System, Lc: Array, Lp: Array, lam: Array, sign: float, y: Array) -> None:
    """y += sign L lam, shape [B, N]: L is minus the transpose of the constraints by velocity."""
    for j in range(len(system.rows)):
        p = system.side[j, 0]
        b = system.side[j, 1]
        for i in range(6):
            if not has_row(system, j, i):
                continue
            t = sign * lam[j, i]
            for k in range(6 + system.elastic[b]):
                y[b, k] += Lc[j, k, i] * t
            if p >= 0:
                for k in range(6 + system.elastic[p]):
                    y[p, k] += Lp[j, k, i] * t
