"""The robots for which curves are optimised: they differ from the model in the ways that move the targets most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.polynomial.hermite_e import hermegauss

from calmotion.arrays import Array
from calmotion.model import Track
from calmotion.model.robust.robots import Scenario
from calmotion.model.robust.settings import WORST
from calmotion.model.run import RunSettings
from calmotion.retargeting.robust.measure import deviations_on, errors_on
from calmotion.retargeting.robust.scenarios import Parameter, scenario_at
from calmotion.retargeting.robust.worst_case import beyond_simulation, largest_weighted
from calmotion.simulation.compiled_shot import CompiledShot

REACH = 3.0  # standard deviations of the farthest robots of a worst case: one of 370 is farther along a direction
LEAST_NOMINAL_WEIGHT = 0.05  # weight of the nominal robot in a mean, where the rule would give it less


def chosen_scenarios(
    shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], parameters: Sequence[Parameter], count: int,
    kind: str,
) -> tuple[Scenario, ...]:  # fmt: skip
    """The nominal robot, and pairs of others along the directions in which the parameters move the targets most.

    The motion of the targets is differentiated by each parameter, by central differences over a standard deviation; the
    eigenvectors of the Gram matrix of these derivatives are the directions. Pairs are shared among them in proportion
    to the motion that they cause. For a mean they stand at the nodes of the Gauss-Hermite rule; for the largest error
    at equal distances up to `REACH`: the outer nodes of that rule (3.75 standard deviations for three pairs) are robots
    that hardly ever are, for whose sake all others would be worse.

    Args:
        shot: The shot.
        options: With the time step.
        tracks: Curves about which the derivatives are taken.
        parameters: What is uncertain.
        count: Number of robots.
        kind: `mean`: nodes and weights of the Gauss-Hermite rules; `worst`: equal ones, for which other weights follow.

    Raises:
        ShotError: One of the robots that differ by a standard deviation cannot be simulated.
    """
    directions, sizes = _directions(shot, options, tracks, parameters)
    pairs = _shared((count - 1) // 2, sizes)
    points, weights = [np.zeros(len(parameters))], [1.0]
    for direction, number in zip(directions, pairs, strict=True):
        nodes, shares = _equal(number) if kind == WORST else _gauss(number)
        points += [node * direction for node in nodes]
        weights += shares.tolist()
    weights[0] = 1.0 if kind == WORST else max(1.0 - sum(weights[1:]), LEAST_NOMINAL_WEIGHT)
    given = np.array(weights)
    return tuple(
        scenario_at(parameters, x, float(weight)) for x, weight in zip(points, given / given.sum(), strict=True)
    )


@dataclass(frozen=True, eq=False)
class Candidates:
    """Random robots, from which those with the largest errors are taken; curves are measured on others.

    Attributes:
        shot, options, parameters: The shot, the settings with the time step, and what is uncertain.
        points: In standard deviations of the parameters, shape [n, d].
    """

    shot: CompiledShot
    options: RunSettings
    parameters: Sequence[Parameter]
    points: Array

    COUNT: ClassVar[int] = 48
    STRETCH: ClassVar[float] = 1.25  # so that the farthest ones are as far as those of 200
    SEED: ClassVar[int] = 20190705
    ALIKE: ClassVar[float] = 0.5  # least distance of two that are taken, over their own
    LARGER: ClassVar[float] = 1.05  # least error of those that are added over the largest known
    ADDED: ClassVar[int] = 2  # most of them
    NEAR: ClassVar[float] = 0.6  # least error, over the largest one, of those that are tried once more

    @classmethod
    def of(cls, shot: CompiledShot, options: RunSettings, parameters: Sequence[Parameter]) -> Candidates:
        """All of them."""
        points = cls.STRETCH * np.random.default_rng(cls.SEED).standard_normal((cls.COUNT, len(parameters)))
        return cls(shot, options, parameters, points)

    def worst(self, tracks: Sequence[Track], known: float) -> tuple[tuple[Scenario, ...], Candidates]:
        """A few that are not alike on which curves leave larger errors than on known robots, and those that are near.

        Args:
            tracks: Curves with the smallest largest error on the known robots.
            known: That error as it weighs, see `largest_weighted` [m].
        """
        tried = [scenario_at(self.parameters, x) for x in self.points]
        found = largest_weighted(self.shot, errors_on(self.shot, self.options, {"": tracks}, tried)[""])
        found = np.where(np.isfinite(found), found, 0.0)
        picked: list[int] = []
        for k in np.argsort(-found):
            x = self.points[k]
            if len(picked) == self.ADDED or not found[k] > self.LARGER * known:
                break
            if all(np.linalg.norm(x - self.points[j]) > self.ALIKE * np.linalg.norm(self.points[j]) for j in picked):
                picked.append(int(k))
        near = found > self.NEAR * max(known, found.max(initial=0.0))
        near[picked] = False
        return tuple(tried[k] for k in picked), replace(self, points=self.points[near])


def _equal(pairs: int) -> tuple[Array, Array]:
    """So many pairs at equal distances up to `REACH`, and equal weights."""
    ahead = REACH * np.arange(1, pairs + 1) / max(pairs, 1)
    return np.concatenate([-ahead[::-1], ahead]), np.ones(2 * pairs)


def _gauss(pairs: int) -> tuple[Array, Array]:
    """The nodes of the Gauss-Hermite rule with so many pairs but that at zero, and their weights."""
    nodes, shares = hermegauss(2 * pairs + 1)
    away = np.abs(nodes) > 1e-12
    return nodes[away], shares[away] / np.sqrt(2.0 * np.pi)


def _directions(
    shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], parameters: Sequence[Parameter]
) -> tuple[Array, Array]:
    """Orthonormal directions, shape [d, d], and how far a standard deviation along each moves the targets [m],
    largest first."""
    units = np.eye(len(parameters))
    moved = [sign * x for x in units for sign in (1.0, -1.0)]
    scenarios = [scenario_at(parameters, x) for x in moved]
    runs = [robot[""] for robot in deviations_on(shot, options, {"": tracks}, scenarios, _flat)]
    for scenario, run in zip(scenarios, runs, strict=True):
        if not len(run):
            raise beyond_simulation(shot, scenario)
    derivatives = np.array([0.5 * (up - down) for up, down in zip(runs[::2], runs[1::2], strict=True)])
    values, vectors = np.linalg.eigh(derivatives @ derivatives.T)
    order = np.argsort(-values)
    sizes = np.sqrt(np.maximum(values[order], 0.0) / max(derivatives.shape[1], 1))
    # a direction has no sign of its own: one that does not depend on rounding
    axes = vectors[:, order].T
    signs = np.sign(axes[np.arange(len(axes)), np.argmax(np.abs(axes), axis=1)])
    return np.asarray(signs[:, None] * axes), np.asarray(sizes)


def _flat(deviations: Array | None) -> Array:
    return np.zeros(0) if deviations is None else deviations.ravel()


def _shared(pairs: int, sizes: Array) -> list[int]:
    """Numbers of pairs for each direction, in proportion to their sizes (by the rule of D'Hondt)."""
    shares = np.zeros(len(sizes), int)
    for _ in range(pairs):
        shares[int(np.argmax(sizes / (shares + 1)))] += 1
    return shares.tolist()
