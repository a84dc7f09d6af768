"""Curves for a set of robots: the sum of their objectives, or the largest of their errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from calmotion.accuracy.simulate_to_tolerance import found_tracks
from calmotion.errors import ShotError
from calmotion.retargeting.found_curves import best_so_far
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.robust.choice import beyond_simulation, chosen_scenarios
from calmotion.retargeting.robust.measure import errors_on
from calmotion.retargeting.robust.scenarios import Parameter, random_scenarios, uncertain_parameters
from calmotion.shot import Result
from calmotion.shot.character import Array
from calmotion.shot.robust.robots import Compromise, Robustness, Scenario
from calmotion.shot.robust.settings import WORST
from calmotion.shot.run import RunSettings
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.simulate import Progress
from calmotion.support import interrupts

ROUNDS = 6  # most searches with other weights
FALLING = 0.98  # of the largest error: a smaller gain ends them
_SEARCHED = 0.6  # share of the searches in the progress
OTHERS = 0.25  # weight of the other robots in each compromise, over that in the one before
LEAST = 1e-3  # smallest weight of a robot, over the mean
Continued = Callable[[Result, Result], Result]


def retarget_robustly(
    shot: CompiledShot, options: RunSettings, nominal: Result, continued: Continued, progress: Progress
) -> Result:
    """Continue a search for the nominal robot with a set of robots, and measure all curves on robots drawn at random.

    An interrupt (Ctrl-C) ends both; the result then has the best curves so far.

    For the largest error, the weights of the robots with large errors are raised until the largest stops falling.

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
    rounds = ROUNDS if robust.kind == WORST else 1
    try:
        tracks = found_tracks(nominal, animation)
        used = scenarios = chosen_scenarios(shot, options, tracks, parameters, robust.scenarios, robust.kind)
        least = np.inf
        for number in range(rounds):
            begun = shot.with_tracks(found_tracks(best, animation))
            latest = _searched(begun, options, _part(progress, number, rounds), scenarios)
            if latest.interrupted:
                return continued(best, latest)
            errors = errors_on(shot, options, {"": found_tracks(latest, animation)}, scenarios)[""].max(axis=1)
            if errors.max() > FALLING * least:
                break
            best, used, least = continued(best, latest), scenarios, float(errors.max())
            scenarios = _reweighted(scenarios, errors)
        draws = random_scenarios(parameters, robust.draws)
        measured = replace(best, robustness=_robustness(shot, options, nominal, best, used, draws, progress))
        return _with_compromises(shot, options, measured, draws, progress)
    except KeyboardInterrupt:
        return best_so_far(best)


def _searched(shot: CompiledShot, options: RunSettings, progress: Progress, scenarios: tuple[Scenario, ...]) -> Result:
    """A search for a set of robots; where it fails, the error tells on which of them."""
    try:
        return optimize_shot(shot, options, progress, None, scenarios)
    except ShotError as error:
        off = errors_on(shot, options, {"": shot.animation.tracks}, scenarios)[""].max(axis=1)
        raise beyond_simulation(shot, scenarios[int(np.argmax(off))], error.problem) from error


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
    shot: CompiledShot, options: RunSettings, robust: Result, draws: tuple[Scenario, ...], progress: Progress
) -> Result:  # fmt: skip
    """The robust result with as many compromises as wanted: searches in which the nominal robot weighs ever more.

    An interrupt (Ctrl-C) ends them.
    """
    found, asked, curves = robust.robustness, options.robust, found_tracks(robust, shot.animation)
    assert found is not None and asked is not None
    compromises: list[Compromise] = []
    try:
        for number in range(asked.tradeoff):
            scenarios = _rather_nominal(found.scenarios, OTHERS ** (number + 1))
            latest = _searched(
                shot.with_tracks(curves), options, _part(progress, number, asked.tradeoff), scenarios
            )  # fmt: skip
            if latest.interrupted:
                break
            curves = found_tracks(latest, shot.animation)
            errors = errors_on(shot, options, {"": curves}, (*scenarios[:1], *draws))[""]
            compromises.append(Compromise(scenarios[0].weight, errors[0], errors[1:]))
    except KeyboardInterrupt:
        interrupts.answer()
    return replace(robust, robustness=replace(found, compromises=tuple(compromises)))


def _rather_nominal(scenarios: Sequence[Scenario], share: float) -> tuple[Scenario, ...]:
    """The robots, the nominal one first, with the weights of all others multiplied by a share."""
    others = tuple(replace(s, weight=share * s.weight) for s in scenarios[1:])
    return (replace(scenarios[0], weight=1.0 - sum(s.weight for s in others)), *others)


def _part(progress: Progress, number: int, rounds: int) -> Progress:
    """Progress of one of several searches."""

    def part(fraction: float, message: str) -> None:
        progress(_SEARCHED * (number + fraction) / rounds, message)

    return part
