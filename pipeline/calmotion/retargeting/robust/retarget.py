"""Curves for a set of robots: the sum of their objectives, or the largest of their errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Result, Track
from calmotion.model.robust.robots import Compromise, Robustness, Scenario
from calmotion.model.robust.settings import WORST
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.retargeting.found_curves import best_so_far
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.robust.choice import (
    beyond_simulation,
    chosen_scenarios,
    largest_weighted,
    tried_robots,
    worse_robots,
)
from calmotion.retargeting.robust.measure import errors_on, silent
from calmotion.retargeting.robust.scenarios import Parameter, random_scenarios, uncertain_parameters
from calmotion.retargeting.robust.worst_case import WorstCase
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.simulate import Progress
from calmotion.support import interrupts
from calmotion.tolerance.simulation import found_tracks

ROUNDS = 6  # most searches with other weights
FALLING = 0.98  # of the largest error: a smaller gain ends them
_SEARCHED = 0.6  # share of the searches in the progress
SEARCHES = 3  # most for the largest error, each with more robots than the one before
FARTHER = 2.0  # error that each compromise allows on the nominal robot, over that of the one before
BOUNDED = 6  # random robots for which a bound is worked out; of the bartender, 4 and 16 give the same to 0.1%
LEAST = 1e-3  # smallest weight of a robot, over the mean
Continued = Callable[[Result, Result], Result]


def retarget_robustly(
    shot: CompiledShot, options: RunSettings, nominal: Result, continued: Continued, progress: Progress
) -> Result:
    """Continue a search for the nominal robot with a set of robots, and measure all curves on robots drawn at random.

    An interrupt (Ctrl-C) ends both; the result then has the best curves so far.

    The largest error is minimised as `WorstCase` does. Where that is not possible, as for loops, feet on the ground and
    very long shots, the weights of the robots with large errors are raised until the largest stops falling.

    Args:
        shot: The shot as animated.
        options: Of the search, with its time step and `robust`.
        nominal: The result for the nominal robot.
        continued: The result of a second search with the work of the first one.
        progress: Called with a fraction and a message.

    Raises:
        ShotError: Nothing is uncertain, or a robot cannot be simulated.
    """
    robust = options.robust
    assert robust is not None
    parameters, animation, best = uncertainties_of(shot), shot.animation, nominal
    allowed = robust.nominal_error * tolerance_of(shot.character, options.tolerance)
    try:
        tracks = found_tracks(nominal, animation)
        used = chosen_scenarios(shot, options, tracks, parameters, robust.scenarios, robust.kind)
        worst = WorstCase(shot, options, tracks, used) if robust.kind == WORST else None
        if worst is None or not worst.possible:
            worst = None
            best, used = _by_weights(shot, options, nominal, used, continued, progress)
        else:
            _minimize(shot, options, worst, allowed, _part(progress, 0, 1))
            used = worst.weighted()
            best = _of_least_maximum(shot, options, nominal, worst, used, continued)
        if best.interrupted:
            return best
        draws = random_scenarios(parameters, robust.draws)
        if worst is None or not robust.tradeoff:
            worst = None  # it is large
        measured = replace(best, robustness=_robustness(shot, options, nominal, best, used, draws, progress))
        if worst is not None:
            measured = _with_compromises(shot, options, measured, draws, worst)
            worst = None
        return _with_bound(shot, options, measured, draws) if robust.bound else measured
    except KeyboardInterrupt:
        return best_so_far(best)


def _minimize(
    shot: CompiledShot, options: RunSettings, worst: WorstCase, allowed: float, progress: Progress
) -> None:  # fmt: skip
    """The smallest largest error over some robots, and those on which it turns out larger."""
    parameters = uncertainties_of(shot)
    points = tried_robots(parameters)
    with worst.work.timed():
        worst.minimize(allowed, progress)
        for _ in range(SEARCHES - 1):
            known = float(largest_weighted(shot, worst.errors())[1:].max())
            added, points = worse_robots(shot, options, worst.tracks, parameters, known, points)
            if not (added and worst.take_in(added)):
                break
            worst.minimize(allowed, progress)


def _of_least_maximum(
    shot: CompiledShot, options: RunSettings, nominal: Result, worst: WorstCase, scenarios: Sequence[Scenario],
    continued: Continued,
) -> Result:  # fmt: skip
    """The result with the curves of the smallest largest error."""
    as_they_are = replace(options, max_iterations=0)
    found = optimize_shot(shot.with_tracks(worst.tracks), as_they_are, silent, None, scenarios)
    return continued(
        nominal,
        replace(
            found,
            iterations=worst.work.evaluations,
            gradients=worst.work.linearizations,
            linearized_sweeps=worst.work.sweeps,
            forward_simulations=found.forward_simulations + worst.work.evaluations + worst.work.linearizations,
            wall_s=worst.work.wall_s,
            processor_s=worst.work.processor_s,
        ),
    )


def _by_weights(
    shot: CompiledShot, options: RunSettings, nominal: Result, scenarios: tuple[Scenario, ...], continued: Continued,
    progress: Progress,
) -> tuple[Result, tuple[Scenario, ...]]:  # fmt: skip
    """The result of searches for weighted sums of squares, and their robots."""
    assert options.robust is not None
    best, used, least, rounds = nominal, scenarios, np.inf, ROUNDS if options.robust.kind == WORST else 1
    for number in range(rounds):
        begun = shot.with_tracks(found_tracks(best, shot.animation))
        latest = _searched(begun, options, _part(progress, number, rounds), scenarios)
        if latest.interrupted:
            return continued(best, latest), used
        errors = _largest_on(shot, options, found_tracks(latest, shot.animation), scenarios)
        if errors.max() > FALLING * least:
            break
        best, used, least = continued(best, latest), scenarios, float(errors.max())
        scenarios = _reweighted(scenarios, errors)
    return best, used


def _searched(shot: CompiledShot, options: RunSettings, progress: Progress, scenarios: tuple[Scenario, ...]) -> Result:
    """A search for a set of robots; where it fails, the error tells on which of them."""
    try:
        return optimize_shot(shot, options, progress, None, scenarios)
    except ShotError as error:
        off = _largest_on(shot, options, shot.animation.tracks, scenarios)
        raise beyond_simulation(shot, scenarios[int(np.argmax(off))], error.problem) from error


def _largest_on(
    shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], scenarios: Sequence[Scenario]
) -> Array:  # fmt: skip
    """The largest error of any target on each robot [m], shape [S]."""
    return np.asarray(errors_on(shot, options, {"": tracks}, scenarios)[""].max(axis=1))


def uncertainties_of(shot: CompiledShot) -> tuple[Parameter, ...]:
    """The uncertain parameters of a shot.

    Raises:
        ShotError: There are none.
    """
    parameters = uncertain_parameters(shot)
    if not parameters:
        given = shot.character.retarget.uncertainty
        raise ShotError(
            "no parameter of the robot is uncertain, so there are no robots to be robust against",
            path=shot.character.path,
            attribute="calm:retarget:uncertainty:modulus, :damping, :payload and :gains",
            found=f"{given.modulus:g}, {given.damping:g}, {given.payload:g} and {given.gains:g}",
            remedy="Set one of them above zero that the robot has: a flexible body has a modulus and a damping, a "
            "rigid body at the end of a chain is payload, a motor that gives has gains; or leave out --robust.",
        )
    return parameters


def _reweighted(scenarios: Sequence[Scenario], errors: Array) -> tuple[Scenario, ...]:
    """The robots with weights that are raised where errors are large."""
    weights = np.array([scenario.weight for scenario in scenarios]) * (errors / errors.mean()) ** 2
    weights = np.maximum(weights / weights.sum(), LEAST / len(scenarios))
    weights /= weights.sum()
    return tuple(replace(s, weight=float(weight)) for s, weight in zip(scenarios, weights, strict=True))


def _robustness(
    shot: CompiledShot, options: RunSettings, nominal: Result, robust: Result, scenarios: tuple[Scenario, ...],
    draws: tuple[Scenario, ...], progress: Progress,
) -> Robustness:  # fmt: skip
    """All curves on the nominal robot and on random ones, `draws`."""
    assert options.robust is not None
    animation = shot.animation
    curves = {
        "before": animation.tracks,
        "nominal": found_tracks(nominal, animation),
        "robust": found_tracks(robust, animation),
    }
    on_nominal = errors_on(shot, options, curves, scenarios[:1])

    def measured(fraction: float, message: str) -> None:
        progress(_SEARCHED + (1.0 - _SEARCHED) * fraction, message)

    drawn = errors_on(shot, options, curves, draws, measured)
    return Robustness(options.robust.kind, scenarios, {name: rows[0] for name, rows in on_nominal.items()}, drawn)


def _with_compromises(
    shot: CompiledShot, options: RunSettings, robust: Result, draws: tuple[Scenario, ...], worst: WorstCase
) -> Result:
    """The robust result with as many compromises as wanted, which may be farther and farther off on the nominal robot.

    An interrupt (Ctrl-C) ends them.
    """
    found, asked, compromises = robust.robustness, options.robust, list[Compromise]()
    assert found is not None and asked is not None
    allowed = asked.nominal_error * tolerance_of(shot.character, options.tolerance)
    try:
        for _ in range(asked.tradeoff):
            allowed *= FARTHER
            _minimize(shot, options, worst, allowed, silent)
            errors = errors_on(shot, options, {"": worst.tracks}, (*found.scenarios[:1], *draws))[""]
            compromises.append(Compromise(worst.weighted()[0].weight, allowed, errors[0], errors[1:]))
    except KeyboardInterrupt:
        interrupts.answer()
    return replace(robust, robustness=replace(found, compromises=tuple(compromises)))


def _with_bound(
    shot: CompiledShot, options: RunSettings, robust: Result, draws: tuple[Scenario, ...]
) -> Result:  # fmt: skip
    """The robust result with the error below which no curves can bring the largest one on the random robots: on those
    of them on which it is largest, which is at most as large as on all. None after an interrupt (Ctrl-C)."""
    found, asked = robust.robustness, options.robust
    assert found is not None and asked is not None
    errors = largest_weighted(shot, found.drawn["robust"])
    most = np.argsort(-np.where(np.isfinite(errors), errors, 0.0))[:BOUNDED]
    tracks = found_tracks(robust, shot.animation)
    allowed = asked.nominal_error * tolerance_of(shot.character, options.tolerance)
    try:
        several = WorstCase(shot, options, tracks, (Scenario(), *(draws[k] for k in most)))
        if several.possible:
            return replace(robust, robustness=replace(found, least_possible=several.least_possible(allowed)))
    except KeyboardInterrupt:
        interrupts.answer()
    return robust


def _part(progress: Progress, number: int, rounds: int) -> Progress:
    """Progress of one of several searches."""

    def part(fraction: float, message: str) -> None:
        progress(_SEARCHED * (number + fraction) / rounds, message)

    return part
