"""Radau IIA with three stages, for reference solutions: order 5 in positions and velocities, 3 in multipliers.

The index-2 system (Seed (31), with alpha = 0: the drift of the constraints in position is of the order of the method).
Unknowns of a step are its stages' coordinates X = (c - c_0, theta, u - u_0), theta the rotation vector from the step's
start, and multipliers; with d the inverse of the Butcher matrix

    X'_i = sum_j d_ij X_j / h,   omega_i = J_r(theta_i) theta'_i,   V'_i = sum_j d_ij (V_j - V_0) / h

and the last stage is the new state. Newton's method on all stages at once, in dense matrices: exact, not fast.
Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, sections IV.5 and VII.4.
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.kernels.sliders import LENGTH, has_row, slides_freely
from calmotion.multibody.kernels.so3 import (
    inverse_right_jacobian,
    matrix_of,
    right_jacobian,
    right_jacobian_derivative,
    turn,
)
from calmotion.multibody.linear_solver.index1 import VELOCITY_ROWS
from calmotion.multibody.model.system import JOINT_ROWS, State, System, allocate_state
from calmotion.multibody.motors.between_instants import Drive, stage_inputs

_ROOT = np.sqrt(6.0)
NODES = np.array([(4.0 - _ROOT) / 10.0, (4.0 + _ROOT) / 10.0, 1.0])
BUTCHER = np.array(
    [
        [(88.0 - 7.0 * _ROOT) / 360.0, (296.0 - 169.0 * _ROOT) / 1800.0, (-2.0 + 3.0 * _ROOT) / 225.0],
        [(296.0 + 169.0 * _ROOT) / 1800.0, (88.0 + 7.0 * _ROOT) / 360.0, (-2.0 - 3.0 * _ROOT) / 225.0],
        [(16.0 - _ROOT) / 36.0, (16.0 + _ROOT) / 36.0, 1.0 / 9.0],
    ]
)
DIFFERENCES = np.linalg.inv(BUTCHER)
TOLERANCE = 1e-12  # of a Newton correction, in `System.unit`
LIMIT = 30
RANK = 1e-11  # singular values below this part of the largest count as zero


def integrate(system: System, start: State, drive: Drive, times: Array, ws: Workspace) -> State:
    """Integrate from a state that satisfies the constraints in position and velocity.

    Args:
        start: Positions and velocities.
        drive: Motor inputs, see `drives`.
        times: Instants [s], uniform, shape [T]; the first is the start's.

    Returns:
        States of all instants, with a leading time axis; the first one's multipliers are zero.

    Raises:
        SimulationFailure: A step whose equations Newton's method does not solve.
    """
    states = State(*[np.zeros((len(times),) + part.shape) for part in start])
    for part, value in zip(states, start, strict=True):
        part[0] = value
    states.lam[0] = 0.0
    inputs = stage_inputs(drive, times, NODES)
    stepper = _Stepper(system, ws)
    for n in range(1, len(times)):
        before = State(*[part[n - 1] for part in states])
        component = stepper.step(before, times[n] - times[n - 1], inputs[n - 1])
        if component >= 0:
            raise SimulationFailure(float(times[n]), component, Reason.DIVERGED)
        for part, value in zip(states, stepper.stages[-1], strict=True):
            part[n] = value
    return states


class _Stepper:
    """One step after another of one system."""

    def __init__(self, system: System, ws: Workspace):
        self.system, self.ws = system, ws
        self.stages = [allocate_state(system) for _ in NODES]
        self.sizes = 6 + system.elastic
        self.offset = np.concatenate([[0], np.cumsum(self.sizes)])
        self.coordinates = [slice(a, b) for a, b in zip(self.offset[:-1], self.offset[1:], strict=True)]
        rows = [(j, i) for j in range(len(system.rows)) for i in range(JOINT_ROWS) if has_row(system, j, i)]
        self.rows = np.array(rows, int).reshape(-1, 2)
        self.chains_closed = len(system.rows) > len(system.parent)
        self.Vd = [np.zeros_like(self.stages[0].V) for _ in NODES]

    def _flat(self, values: Array) -> Array:
        """[B, N] without the padding."""
        return np.concatenate([values[b, :n] for b, n in enumerate(self.sizes)])

    def _coordinates(self, before: State, stage: State) -> Array:
        """X of a stage, shape [x]."""
        values = np.zeros_like(stage.V)
        values[:, :3], values[:, 3:6], values[:, 6:] = stage.c - before.c, stage.turn, stage.u - before.u
        return self._flat(values)

    def _velocities(self, before: State, h: float) -> list[Array]:
        """V and V' of all stages from their coordinates; returns theta' of each, shape [B, 3]."""
        X = np.array([self._coordinates(before, stage) for stage in self.stages])
        slopes = DIFFERENCES @ X / h
        J, theta_rates = np.zeros((3, 3)), []
        for stage, slope in zip(self.stages, slopes, strict=True):
            rates = np.zeros_like(before.c)
            for b, part in enumerate(self.coordinates):
                stage.V[b, : self.sizes[b]] = slope[part]
                rates[b] = slope[part][3:6]
                right_jacobian(stage.turn[b], J)
                stage.V[b, 3:6] = J @ rates[b]
            theta_rates.append(rates)
        gained = np.array([stage.V - before.V for stage in self.stages])
        for i, Vd in enumerate(self.Vd):
            Vd[:] = np.einsum("j,jbn->bn", DIFFERENCES[i], gained) / h
        return theta_rates

    def _velocity_jacobian(self, theta_rates: list[Array], h: float) -> tuple[Array, Array]:
        """dV of all stages (translations in world axes) by all their corrections (body axes), shape [3 x, 3 x]; and the
        turn of translations from world into body axes, shape [3 x, 3 x]."""
        x, s = self.offset[-1], len(NODES)
        dV, turned = np.zeros((s * x, s * x)), np.eye(s * x)
        Ji, Jj, A, R = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
        for i, stage in enumerate(self.stages):
            for b, part in enumerate(self.coordinates):
                at = i * x + part.start
                right_jacobian(stage.turn[b], Ji)
                for j, other in enumerate(self.stages):
                    to, d = j * x + part.start, DIFFERENCES[i, j] / h
                    matrix_of(other.q[b], R)
                    inverse_right_jacobian(other.turn[b], Jj)
                    dV[at : at + 3, to : to + 3] = d * R
                    dV[at + 3 : at + 6, to + 3 : to + 6] = d * Ji @ Jj
                    elastic = np.arange(6, self.sizes[b])
                    dV[at + elastic, to + elastic] = d
                right_jacobian_derivative(stage.turn[b], theta_rates[i][b], 1.0, A)
                inverse_right_jacobian(stage.turn[b], Jj)
                dV[at + 3 : at + 6, at + 3 : at + 6] += A @ Jj
                matrix_of(stage.q[b], R)
                turned[at : at + 3, at : at + 3] = R.T
        return dV, turned

    def _stage_blocks(self, i: int, inputs: Array) -> tuple[Array, ...]:
        """Residuals and their derivatives by position, velocity, acceleration and multipliers at stage i, dense."""
        system, ws, stage = self.system, self.ws, self.stages[i]
        Hv = np.zeros_like(ws.scratch.Hv)
        assemble(system, VELOCITY_ROWS, stage, self.Vd[i], inputs[i, 0], inputs[i, 1], Hv, True, ws.work, ws.blocks)
        blocks, x, m = ws.blocks, self.offset[-1], len(self.rows)
        K, P, D = np.zeros((x, x)), np.zeros((x, x)), np.zeros((x, x))
        L, H = np.zeros((x, m)), np.zeros((m, x))
        for b, part in enumerate(self.coordinates):
            n = self.sizes[b]
            K[part, part], P[part, part], D[part, part] = blocks.K[b, :n, :n], blocks.P[b, :n, :n], blocks.D[b, :n, :n]
        for j, (p, b) in enumerate(system.side):
            part, n = self.coordinates[b], self.sizes[b]
            rows = np.flatnonzero(self.rows[:, 0] == j)
            kept = self.rows[rows, 1]
            L[part, rows] = blocks.Lc[j, :n][:, kept]
            H[rows, part] = blocks.Hc[j, kept, :n]
            if p < 0:
                continue
            parent, k = self.coordinates[p], self.sizes[p]
            L[parent, rows] = blocks.Lp[j, :k][:, kept]
            H[rows, parent] = blocks.Hp[j, kept, :k]
            K[part, parent] += blocks.Nc[j, :n] @ blocks.Jp[j, :, :k]
            if slides_freely(system, j):
                # the parent's rows by the length, which follows the coordinates of both
                K[parent, part] -= np.outer(blocks.Lp[j, :k, LENGTH], blocks.Hc[j, LENGTH, :n])
                K[parent, parent] -= np.outer(blocks.Lp[j, :k, LENGTH], blocks.Hp[j, LENGTH, :k])
        gap = blocks.gap[self.rows[:, 0], self.rows[:, 1]]
        return self._flat(blocks.res), gap, K, P, D, L, H

    def step(self, before: State, h: float, inputs: Array) -> int:
        """Fill the stages; -1, or the component where Newton's method fails."""
        x, m, s = self.offset[-1], len(self.rows), len(NODES)
        units = np.tile(self._flat(self.system.unit), s)
        levers = np.tile(np.where(self.rows[:, 1] < 3, 1.0, self.system.unit[0, 0]), s)
        for node, stage in zip(NODES, self.stages, strict=True):
            stage.c[:] = before.c + node * h * before.V[:, :3]
            stage.u[:] = before.u + node * h * before.V[:, 6:]
            stage.turn[:] = node * h * before.V[:, 3:6]
            stage.lam[:] = before.lam
            for b in range(len(before.c)):
                turn(before.q[b], stage.turn[b], stage.q[b])
        for _ in range(LIMIT):
            theta_rates = self._velocities(before, h)
            dV, turned = self._velocity_jacobian(theta_rates, h)
            # accelerations follow from velocities as velocities from positions
            dA = (np.kron(DIFFERENCES, np.eye(x)) / h) @ dV
            dV, dA = turned @ dV, turned @ dA
            A, right = np.zeros((s * (x + m), s * (x + m))), np.zeros(s * (x + m))
            for i in range(s):
                res, gap, K, P, D, L, H = self._stage_blocks(i, inputs)
                at, rows = slice(i * x, (i + 1) * x), slice(s * x + i * m, s * x + (i + 1) * m)
                A[at, : s * x] = P @ dV[at] + D @ dA[at]
                A[at, at] += K
                A[at, rows] = L
                A[rows, : s * x] = -L.T @ dV[at]
                A[rows, at] += H
                right[at], right[rows] = -res, -gap
            if self.chains_closed:
                # Redundant constraints: the motion is unique, and the multipliers are those of least norm. The rank is
                # determined with accelerations and forces as unknowns and velocities as constraints.
                A[:, : s * x] *= h * h
                A[s * x :] /= h
                right[s * x :] /= h
                A[:, s * x :] *= levers
                solution = np.linalg.lstsq(A, right, rcond=RANK)[0]
                solution[: s * x] *= h * h
                solution[s * x :] *= levers
            else:
                solution = np.linalg.solve(A, right)
            size = np.abs(solution[: s * x] / units).max()
            if not np.isfinite(size) or size > 1e3:
                break
            for i, stage in enumerate(self.stages):
                self._correct(before, stage, solution[i * x : (i + 1) * x])
                stage.lam[self.rows[:, 0], self.rows[:, 1]] += solution[s * x + i * m : s * x + (i + 1) * m]
            if size < TOLERANCE:
                self._velocities(before, h)
                return -1
        worst = int(np.argmax(np.nan_to_num(np.abs(right[:x]), nan=np.inf)))
        return int(np.searchsorted(self.offset, worst, side="right")) - 1

    def _correct(self, before: State, stage: State, correction: Array) -> None:
        R, T = np.zeros((3, 3)), np.zeros((3, 3))
        for b, part in enumerate(self.coordinates):
            change = correction[part]
            matrix_of(stage.q[b], R)
            inverse_right_jacobian(stage.turn[b], T)
            stage.c[b] += R @ change[:3]
            stage.turn[b] += T @ change[3:6]
            stage.u[b, : self.sizes[b] - 6] += change[6:]
            turn(before.q[b], stage.turn[b], stage.q[b])
