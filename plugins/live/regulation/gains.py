"""The linear quadratic regulator with preview for a robot in a pose (formulation, section 12).

Between two ticks the commands run straight; at a tick their rates change, which strikes the modes. The state is

    x = (d, d', a, a'),    x+ = transition x + by_change v + by_impulse i

with the deviation d of the commands from the intended ones, the amplitudes a of the modes of each robot that is thought
possible, the change v of d' at a tick, and the impulses i of the intended motion on the modes. Least

    sum |targets x|^2 + sum (penalty v)^2     over all ticks,

with impulses known for a window and zero after it, has the solution v = -feedback x - sum_k preview_k i_k.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array, BoolArray
from calmotion.multibody import PoseModel
from calmotion.simulation import SLOWEST
from scipy.linalg import block_diag, expm

from .efforts import Efforts


@dataclass(frozen=True)
class Weighting:
    """What counts.

    Attributes:
        tick: Time between two commands [s].
        window: Ticks that are known ahead.
        targets: Root of the weight of each coordinate of each target, shape [K, 6].
        penalty: Of a change of a command's rate [m s/rad], shape [m].
        closeness: Of the deviation of a command from the intended one [m/rad].
        frequencies: Factors of the frequencies of the robots that are thought possible.
        shares: Of these robots in what counts; their sum is 1. The robot of the model is in the middle.
        limited: Motors whose efforts are kept within limits, shape [M]; None: none.
    """

    LEAST_DAMPING = 1e-3  # ratio of critical, so that what no motor reaches dies away in the sums
    FREE = (
        2.0 * np.pi * SLOWEST
    )  # least angular frequency, so that free motions do, such as the spin of a ball joint [rad/s]

    tick: float
    window: int
    targets: Array
    penalty: Array
    closeness: float
    frequencies: tuple[float, ...] = (1.0,)
    shares: tuple[float, ...] = (1.0,)
    limited: BoolArray | None = None

    def with_others(self, uncertainty: float, share: float) -> Weighting:
        """The same with two robots beside that of the model, which have a share in what counts.

        Args:
            uncertainty: Share of frequency by which one is slower and one is faster.
        """
        if not uncertainty * share:
            return replace(self, frequencies=(1.0,), shares=(1.0,))
        factors = (1.0 - uncertainty, 1.0, 1.0 + uncertainty)
        return replace(self, frequencies=factors, shares=(0.5 * share, 1.0 - share, 0.5 * share))

    @property
    def spread(self) -> float:
        """Standard deviation of the frequencies, over those of the model."""
        return float(np.sqrt(np.square(np.subtract(self.frequencies, 1.0)) @ self.shares))


@dataclass(frozen=True, eq=False)
class Gains:
    """The regulator in a pose (m motors that may deviate, n modes, S robots).

    Attributes:
        pose: The robot there.
        transition, by_change, by_impulse: Of the state, shapes [X, X], [X, m], [X, S n].
        targets: Weighted motion of the targets by the state, shape [S 6 K, X].
        feedback, preview: Shapes [m, X] and [window, m, S n].
        robots: S.
        efforts: Those of the motors with limits; None: none has.
    """

    pose: PoseModel
    transition: Array
    by_change: Array
    by_impulse: Array
    targets: Array
    feedback: Array
    preview: Array
    robots: int
    efforts: Efforts | None = None

    def impulses(self, accelerations: Array, rates: Array, forces: Array, tick: float) -> Array:
        """Impulses of the intended motion on the modes of all robots, shape [T, S n].

        Args:
            accelerations, rates: Of all motors' intended inputs, shape [T, M].
            forces: `VelocityForces` of these, shape [T, N].
        """
        pose = self.pose
        own = accelerations @ pose.by_acceleration.T + rates @ pose.by_rate.T - forces @ pose.shapes
        return tick * np.tile(own, self.robots)

    def state_from(self, x: Array, other: Gains) -> Array:
        """A state in the modes of another pose, in those of this one."""
        m, turned = self.by_change.shape[1], self.pose.amplitudes_of(other.pose)
        rest = x[2 * m :].reshape(2, self.robots, turned.shape[1])
        return np.concatenate([x[: 2 * m], (rest @ turned.T).ravel()])


def gains_at(pose: PoseModel, coupling: Array, weighting: Weighting) -> Gains:
    """The regulator for a robot in a pose.

    Args:
        coupling: Of all motors with those that may deviate, shape [M, m].
    """
    m, n, h = coupling.shape[1], len(pose.omega), weighting.tick
    robots = len(weighting.frequencies)
    weights, roots = weighting.targets[..., None], np.sqrt(weighting.shares)[:, None, None]
    by_input = (weights * (pose.targets_by_input @ coupling)).reshape(weights.size, m)
    by_mode = (weights * pose.targets_by_mode).reshape(weights.size, n)
    size = 2 * (m + robots * n)
    d, rate = np.arange(m), m + np.arange(m)
    a = 2 * m + np.arange(robots * n)
    speed = a + robots * n
    flow = np.zeros((size, size))
    flow[d, rate] = flow[a, speed] = 1.0
    natural = np.maximum(pose.omega, weighting.FREE)
    omega = np.concatenate([factor * natural for factor in weighting.frequencies])
    damping = [pose.damping + np.diag(2.0 * weighting.LEAST_DAMPING * natural)] * robots
    flow[speed, a] = -(omega**2)
    flow[np.ix_(speed, speed)] = -block_diag(*damping)
    flow[np.ix_(speed, rate)] = np.tile(pose.by_rate @ coupling, (robots, 1))
    transition = expm(h * flow)
    strikes = np.zeros((size, m))
    strikes[rate, d] = 1.0
    strikes[speed] = np.tile(pose.by_acceleration @ coupling, (robots, 1))
    by_change, by_impulse = transition @ strikes, transition[:, speed]
    targets = np.zeros((robots * len(by_input), size))
    targets[:, :m] = (roots * by_input).reshape(len(targets), m)
    targets[:, a] = block_diag(*(roots * by_mode))
    least = targets.T @ targets
    least[d, d] += weighting.closeness**2
    value = riccati(transition, by_change, least, weighting.penalty**2)
    answer = np.linalg.solve(np.diag(weighting.penalty**2) + by_change.T @ value @ by_change, by_change.T)
    feedback = answer @ value @ transition
    closed, ahead, preview = transition - by_change @ feedback, value @ by_impulse, []
    for _ in range(weighting.window):
        preview.append(answer @ ahead)
        ahead = closed.T @ ahead
    efforts = None
    if weighting.limited is not None and np.any(weighting.limited):
        rates = np.zeros((len(coupling) + n, size))
        rates[: len(coupling), rate] = coupling
        rates[len(coupling) + np.arange(n), speed[robots // 2 * n :][:n]] = 1.0
        loop = closed, by_change, by_impulse, answer, value @ by_impulse
        efforts = Efforts.of(pose, rates, h, weighting.limited, loop, weighting.window)
    return Gains(pose, transition, by_change, by_impulse, targets, feedback, np.array(preview), robots, efforts)


CONVERGED, SETTLED = 1e-11, 1e-8  # changes of the solution, relative


def riccati(transition: Array, by_change: Array, least: Array, penalty: Array) -> Array:
    """The stabilising solution of the discrete algebraic Riccati equation, shape [X, X].

    By structure-preserving doubling, which also converges where modes hardly damp and no motor reaches them; there
    `scipy.linalg.solve_discrete_are` finds eigenvalues too close to the unit circle (Chu, Fan, Lin, Wang,
    Structure-preserving algorithms for periodic discrete-time algebraic Riccati equations, 2004).

    Args:
        transition, by_change: Shapes [X, X] and [X, m].
        least: Weight of the state, shape [X, X].
        penalty: Weight of each change, shape [m].

    Raises:
        ValueError: It does not converge.
    """
    A, G, H, change = transition, by_change / penalty @ by_change.T, least, np.inf
    for _ in range(60):
        solved = np.linalg.solve(np.eye(len(A)) + G @ H, np.concatenate([A, G], axis=1))
        moved, gained = solved[:, : len(A)], solved[:, len(A) :]
        added = A.T @ H @ moved
        before, last = H, change
        A, G, H = A @ moved, G + A @ gained @ A.T, H + 0.5 * (added + added.T)
        change = float(np.abs(added).max() / np.abs(H).max())
        if change <= CONVERGED:
            return H
        if last <= SETTLED and change > last:  # changes fell as squares, and are of rounding from here on
            return before
    raise ValueError("the Riccati equation has no stabilising solution that doubling finds")
