"""The robots for which curves are optimised: they differ from the model in the ways that move the targets most."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.hermite_e import hermegauss

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Track
from calmotion.model.robust.robots import Scenario
from calmotion.model.robust.settings import WORST
from calmotion.model.run import RunSettings
from calmotion.retargeting.robust.measure import deviations_on, errors_on
from calmotion.retargeting.robust.scenarios import Parameter, scenario_at
from calmotion.simulation.compiled_shot import CompiledShot

REACH = 3.0  # standard deviations of the farthest robots of a worst case: one of 370 is farther along a direction
TRIED, STRETCH = 48, 1.25  # robots that are tried, so far off that their farthest ones are as far as those of 200
ADDED = 2  # most of them that are added
LARGER, ALIKE = 1.05, 0.5  # least error of those added over the largest known, and least distance over their own
NEAR = 0.6  # least error, over the largest one, of robots that are tried once more: others are taken in in between
_SEED = 20190705
LEAST = 0.05  # weight of the nominal robot in a mean, where the rule would give it less


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
    weights[0] = 1.0 if kind == WORST else max(1.0 - sum(weights[1:]), LEAST)
    given = np.array(weights)
    return tuple(
        scenario_at(parameters, x, float(weight)) for x, weight in zip(points, given / given.sum(), strict=True)
    )


def tried_robots(parameters: Sequence[Parameter]) -> Array:
    """Random robots on which curves may be tried, in standard deviations of the parameters, shape [n, d].

    They are not those on which curves are measured.
    """
    return np.asarray(STRETCH * np.random.default_rng(_SEED).standard_normal((TRIED, len(parameters))))


def worse_robots(
    shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], parameters: Sequence[Parameter], known: float,
    points: Array,
) -> tuple[tuple[Scenario, ...], Array]:  # fmt: skip
    """Those of some robots on which curves leave larger errors than on the known ones, and those that are near it.

    Args:
        shot, options, parameters: As of `chosen_scenarios`.
        tracks: Curves with the smallest largest error on the known robots.
        known: That error as it weighs, see `largest_weighted` [m].
        points: The robots to try, in standard deviations of the parameters, shape [n, d].

    Returns:
        Some of them, to be known as well; and the points of others that are to be tried on the next curves, shape
        [m, d].
    """
    tried = [scenario_at(parameters, x) for x in points]
    found = largest_weighted(shot, errors_on(shot, options, {"": tracks}, tried)[""])
    found = np.where(np.isfinite(found), found, 0.0)
    picked: list[int] = []
    for k in np.argsort(-found):
        if found[k] <= LARGER * known or len(picked) == ADDED:
            break
        if all(np.linalg.norm(points[k] - points[j]) > ALIKE * np.linalg.norm(points[j]) for j in picked):
            picked.append(int(k))
    near = found > NEAR * max(known, found.max(initial=0.0))
    near[picked] = False
    return tuple(tried[k] for k in picked), points[near]


def largest_weighted(shot: CompiledShot, errors: Array) -> Array:
    """The largest error of any target as it weighs, shape [S], of errors of the targets, shape [S, K]."""
    return np.asarray((errors * np.sqrt([t.position_weight for t in shot.character.targets])).max(axis=1))


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


def beyond_simulation(shot: CompiledShot, scenario: Scenario, reason: str = "") -> ShotError:
    """The error that says that a robot is too different from the model to be simulated, and the reason."""
    different = ", ".join(f"{name} times {factor:.3g}" for name, factor in scenario.factors.items() if factor != 1.0)
    return ShotError(
        f"a robot with {different} cannot be simulated" + (f": {reason}" if reason else ""),
        path=shot.character.path,
        attribute="calm:retarget:uncertainty",
        remedy="Set a smaller uncertainty: the model is near buckling, or near another limit of what stands.",
    )


def _flat(deviations: Array | None) -> Array:
    return np.zeros(0) if deviations is None else deviations.ravel()


def _shared(pairs: int, sizes: Array) -> list[int]:
    """Numbers of pairs for each direction, in proportion to their sizes (by the rule of D'Hondt)."""
    shares = np.zeros(len(sizes), int)
    for _ in range(pairs):
        shares[int(np.argmax(sizes / (shares + 1)))] += 1
    return shares.tolist()
