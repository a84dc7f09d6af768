"""Curves for a set of robots: the sum of their objectives, or the largest of their errors."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from calmotion.errors import ShotError
from calmotion.model import Result, Track
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.model.uncertainty import WORST, Robustness, Scenario
from calmotion.multibody.failure import SimulationFailure
from calmotion.retargeting.found_curves import best_so_far
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.robust.measure import errors_on, silent
from calmotion.retargeting.robust.robots import farthest, opposite_pairs
from calmotion.retargeting.robust.scenarios import Parameter, random_scenarios, uncertain_parameters
from calmotion.retargeting.robust.worst_case import LeastMaximum, least_maximum
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.simulate import Progress
from calmotion.tolerance.simulation import found_tracks

_SEARCHED = 0.6  # share of the searches in the progress
SEARCHES = 3  # most for the largest error, each with more robots than the one before
LARGER = 1.05  # least error of robots that are added over the largest known
ADDED = 2  # most of them
Continued = Callable[[Result, Result], Result]


def retarget_robustly(
    shot: CompiledShot, options: RunSettings, nominal: Result, continued: Continued, progress: Progress
) -> Result:
    """Continue a search for the nominal robot with a set of robots, and measure all curves on robots drawn at random.

    An interrupt (Ctrl-C) ends both; the result then has the best curves so far.

    Args:
        shot: The shot as animated.
        options: Of the search, with its time step and `robust`.
        nominal: The result for the nominal robot, which is also that of the largest error where no other is better.
        continued: The result of a second search with the work of the first one.
        progress: Called with a fraction and a message.

    Raises:
        ShotError: Nothing is uncertain, or a robot cannot be simulated.
    """
    robust = options.robust
    assert robust is not None
    parameters, animation, best = uncertainties_of(shot), shot.animation, nominal
    allowed = robust.nominal_error * tolerance_of(shot.character, options.tolerance)

    def searching(fraction: float, message: str) -> None:
        progress(_SEARCHED * fraction, message)

    try:
        tracks = found_tracks(nominal, animation)
        if robust.kind == WORST:
            begin = time.perf_counter(), time.process_time()
            worst = _worst(shot, options, tracks, parameters, allowed, searching)
            used = worst.scenarios
            if any(one is not other for one, other in zip(worst.tracks, tracks, strict=True)):
                best = continued(nominal, _simulated(shot, options, worst, begin))
        else:
            used = opposite_pairs(parameters, robust.scenarios)
            best = continued(nominal, _searched(shot.with_tracks(tracks), options, searching, used))
        if best.interrupted:
            return best
        draws = random_scenarios(parameters, robust.draws)
        return replace(best, robustness=_robustness(shot, options, nominal, best, used, draws, progress))
    except KeyboardInterrupt:
        return best_so_far(best)


def _worst(
    shot: CompiledShot, options: RunSettings, tracks: Sequence[Track], parameters: Sequence[Parameter], allowed: float,
    progress: Progress,
) -> LeastMaximum:  # fmt: skip
    """The smallest largest error over the random robots that are farthest off, and those that are so with what was
    found."""
    assert options.robust is not None
    others = farthest(shot, options, tracks, parameters, options.robust.scenarios - 1)
    counts = np.zeros(3, int)
    for _ in range(SEARCHES):
        robots = (Scenario(), *others)
        try:
            found = least_maximum(shot, options, tracks, robots, allowed, progress)
        except SimulationFailure as failure:
            raise _named(shot, options, robots) from failure
        tracks = found.tracks
        counts += found.search.evaluations, found.search.gradients, found.search.products
        known = LARGER * float(found.errors.max())
        added = farthest(shot, options, tracks, parameters, ADDED, known)
        if not added:
            break
        others = (*others, *added)
    evaluations, gradients, products = (int(count) for count in counts)
    return replace(found, search=replace(found.search, evaluations=evaluations, gradients=gradients, products=products))


def _simulated(shot: CompiledShot, options: RunSettings, worst: LeastMaximum, begin: tuple[float, float]) -> Result:
    """The result with the curves of the smallest largest error, and the work since a time of clock and processor."""
    as_they_are = replace(options, max_iterations=0)
    found = optimize_shot(shot.with_tracks(worst.tracks), as_they_are, silent, None, worst.scenarios)
    record = replace(
        found.search,
        iterations=len(worst.search.history),
        gradients=worst.search.gradients,
        linearized_sweeps=2 * worst.search.products + worst.search.gradients,
        forward_simulations=found.search.forward_simulations + worst.search.evaluations,
        processor_s=time.process_time() - begin[1],
    )
    return replace(found, search=record, wall_s=time.perf_counter() - begin[0])


def _named(shot: CompiledShot, options: RunSettings, robots: Sequence[Scenario], reason: str = "") -> ShotError:
    """The error that names the robot that cannot be simulated, or that is farthest off, and the reason."""
    off = errors_on(shot, options, {"": shot.animation.tracks}, robots)[""][..., 0].max(axis=1)
    factors = robots[int(np.argmax(off))].factors
    different = ", ".join(f"{name} times {factor:.3g}" for name, factor in factors.items() if factor != 1.0)
    return ShotError(
        f"a robot with {different} cannot be simulated" + (f": {reason}" if reason else ""),
        path=shot.character.path,
        attribute="calm:retarget:uncertainty",
        remedy="Set a smaller uncertainty: some of these robots buckle, or cannot carry their weight.",
    )


def _searched(shot: CompiledShot, options: RunSettings, progress: Progress, scenarios: tuple[Scenario, ...]) -> Result:
    """A search for the sum over a set of robots; where it fails, the error tells on which of them."""
    try:
        return optimize_shot(shot, options, progress, None, scenarios)
    except ShotError as error:
        raise _named(shot, options, scenarios, error.problem) from error


def uncertainties_of(shot: CompiledShot) -> tuple[Parameter, ...]:
    """The uncertain parameters of a shot.

    Raises:
        ShotError: There are none.
    """
    parameters = uncertain_parameters(shot)
    if not parameters:
        given = shot.character.retarget.uncertainty
        raise ShotError(
            "no parameter of the robot is uncertain, so that a robust search has no other robots",
            path=shot.character.path,
            attribute="calm:retarget:uncertainty:modulus, :damping, :payload and :gains",
            found=f"{given.modulus:g}, {given.damping:g}, {given.payload:g} and {given.gains:g}",
            remedy="Set one of them above zero that the robot has: a flexible body has a modulus and a damping, a "
            "rigid body at the end of a chain is payload, a compliant motor has gains; or leave out --robust.",
        )
    return parameters


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
    nominal_errors = errors_on(shot, options, curves, scenarios[:1])

    def measured(fraction: float, message: str) -> None:
        progress(_SEARCHED + (1.0 - _SEARCHED) * fraction, message)

    drawn = errors_on(shot, options, curves, draws, measured)
    nominally = {name: rows[0] for name, rows in nominal_errors.items()}
    return Robustness(options.robust.kind, scenarios, nominally, drawn)
