"""A set of explanations, fitted together: loops first, joint by joint, then what they leave."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from calmotion.arrays import Array
from scipy.optimize import least_squares

from .explanations.base import AddedExplanation, Effect, Explanation, LoopExplanation, Parameter, State
from .signals import Drive
from .situation import Situation

SWEEPS = 2  # over loops and added explanations
DESCENTS = 14  # evaluations of the Jacobian of a joint's search


@dataclass(frozen=True, eq=False)
class Fit:
    """Explanations that act together.

    Attributes:
        effects: Of each, by its cause.
        left: What they do not explain, a weighted vector.
        count: Values that were fitted.
    """

    effects: Mapping[str, Effect]
    left: Array
    count: int

    @property
    def causes(self) -> tuple[str, ...]:
        """What acts."""
        return tuple(self.effects)


def fit(situation: Situation, explanations: Sequence[Explanation], alone: Mapping[str, Effect] | None = None) -> Fit:
    """Fit explanations together to the samples that are not held out.

    Args:
        alone: Effects of some that were fitted alone, where their search begins.
    """
    loops = [e for e in explanations if isinstance(e, LoopExplanation)]
    added = [e for e in explanations if isinstance(e, AddedExplanation)]
    error, healthy = situation.error, situation.motion
    found: dict[str, Effect] = {}
    chosen: dict[tuple[str, int], dict[str, float]] = {}
    drive = situation.healthy
    for _ in range(SWEEPS if added and len(explanations) > 1 else 1):
        others = sum((found[e.cause].vector for e in added if e.cause in found), np.zeros(len(error)))
        if loops:
            drive = _fit_loops(situation, loops, error - others, chosen, found)
        for explanation in added:
            rest = [effect for cause, effect in found.items() if cause != explanation.cause]
            left = error - sum((effect.vector for effect in rest), np.zeros(len(error)))
            moved = healthy + sum((e.deviation for e in rest if e.deviation is not None), np.zeros_like(healthy))
            state = State(moved, drive)
            start = found.get(explanation.cause) or (alone or {}).get(explanation.cause)
            found[explanation.cause] = explanation.effect(situation, state, left, start)
    left = error - sum((effect.vector for effect in found.values()), np.zeros(len(error)))
    count = sum(effect.count for effect in found.values())
    effects = {e.cause: found[e.cause] for e in explanations}
    return Fit(effects, left, count)


def scores(situation: Situation, fits: Sequence[Fit]) -> Array:
    """Of each fit the negative logarithm of the likelihood of held-out samples, and half of the penalty of BIC.

    Samples that follow each other are not independent: each block counts with as many as the autocorrelation of what
    the best fit leaves there allows, the same for all fits. By the error itself a slow one would count as few samples,
    and nothing could explain it.
    """
    totals, samples = np.zeros(len(fits)), 0.0
    for block in situation.blocks:
        rows = ~situation.fitted[block]
        if not rows.any():
            continue
        powers = np.array([float(np.mean(fit.left[block][rows] ** 2)) for fit in fits])
        size = independent(fits[int(powers.argmin())].left[block])
        # below the noise (a weighted variance of one) nothing is gained
        totals += 0.5 * size * np.log(1.0 + powers)
        samples += size
    counts = np.array([fit.count for fit in fits])
    return np.asarray(totals + 0.5 * counts * np.log(max(samples, 2.0)))


def independent(signal: Array) -> float:
    """Number of independent samples in a signal, by its autocorrelation up to its first zero."""
    n = len(signal)
    own = signal - signal.mean()
    power = np.abs(np.fft.rfft(own, 2 * n)) ** 2
    rho = np.fft.irfft(power)[:n]
    if rho[0] <= 0.0:
        return float(n)
    rho = rho / rho[0]
    first = int(np.argmax(rho <= 0.0)) if (rho <= 0.0).any() else n
    return float(max(n / (1.0 + 2.0 * rho[1:first].sum()), 4.0))


def _fit_loops(
    situation: Situation,
    loops: Sequence[LoopExplanation],
    error: Array,
    chosen: dict[tuple[str, int], dict[str, float]],
    found: dict[str, Effect],
) -> Drive:
    """Fit the loops of all joints; returns how they are driven, and adds an effect for each explanation."""
    drive, kept = situation.healthy, []
    encoders = situation.encoders
    groups = [[m] for m in encoders] or [list(range(len(situation.joints)))]
    for group in groups:
        values = _fit_group(situation, loops, group, error, chosen)
        if values is None:
            continue
        for m in group:
            drive = _applied(situation, loops, drive, m, values)
            kept.append(m)
            for loop in loops:
                own = {p.name: values[loop.cause, p.name] for p in _free(situation, loops, loop, m)}
                chosen[loop.cause, m] = own
    _add_effects(situation, loops, drive, kept, chosen, found, shared=not encoders)
    return drive


def _add_effects(
    situation: Situation, loops: Sequence[LoopExplanation], drive: Drive, kept: Sequence[int],
    chosen: Mapping[tuple[str, int], Mapping[str, float]], found: dict[str, Effect], shared: bool,
) -> None:  # fmt: skip
    """What each loop explanation does: all of them, less all but it; the rest goes to the first in equal parts."""
    whole = situation.moved(drive) - situation.motion
    alone: list[Array] = []
    for loop in loops:
        own = situation.healthy
        for m in kept:
            own = loop.changed(situation, own, m, chosen[loop.cause, m])
        alone.append(situation.moved(own) - situation.motion)
    rest = (whole - sum(alone, np.zeros_like(whole))) / len(loops)
    for loop, deviation in zip(loops, alone, strict=True):
        rows: list[dict[str, Any]] = []
        for m in kept[:1] if shared else kept:
            for p in _free(situation, loops, loop, m):
                path = "all joints" if shared else situation.joints[m].path
                rows.append({"name": p.name, "path": path, "value": chosen[loop.cause, m][p.name], "unit": p.unit})
        shown = deviation + rest
        found[loop.cause] = Effect(situation.of_joints(shown), shown, tuple(rows), len(rows))


def _free(
    situation: Situation, loops: Sequence[LoopExplanation], loop: LoopExplanation, m: int
) -> tuple[Parameter, ...]:
    """Its parameters of a joint without those that an explanation before it has, too: a loop has one frequency."""
    before = loops[: loops.index(loop)]
    taken = {p.name for other in before for p in other.parameters(situation, m)}
    return tuple(p for p in loop.parameters(situation, m) if p.name not in taken)


def _applied(
    situation: Situation,
    loops: Sequence[LoopExplanation],
    drive: Drive,
    m: int,
    values: Mapping[tuple[str, str], float],
) -> Drive:
    for loop in loops:
        names = [p.name for p in _free(situation, loops, loop, m)]
        drive = loop.changed(situation, drive, m, {name: values[loop.cause, name] for name in names})
    return drive


def _fit_group(
    situation: Situation,
    loops: Sequence[LoopExplanation],
    group: Sequence[int],
    error: Array,
    chosen: Mapping[tuple[str, int], Mapping[str, float]],
) -> dict[tuple[str, str], float] | None:
    """The values of the parameters of some joints that share them; None where they are not worth it."""
    own: dict[tuple[str, str], Parameter] = {}
    for loop in loops:
        for p in _free(situation, loops, loop, group[0]):
            own[loop.cause, p.name] = p
    single = len(group) == 1 and group[0] in situation.encoders
    block = situation.blocks[situation.blocks_of[situation.encoders[group[0]]][0]] if single else slice(None)
    keep, target = situation.fitted[block], error[block]
    if not keep.any():
        return None
    sigma = max(float(np.sqrt(np.mean(target[keep] ** 2))), 1.0)
    scale = 1.0 / (sigma * np.sqrt(float(keep.sum())))
    size = independent(target) if single else float(len(situation.times) * situation.h * 10.0)

    def left(x: Array) -> Array:
        values = {key: p.value(float(v)) for (key, p), v in zip(own.items(), x, strict=True)}
        prior = [(v - p.scaled(p.starts[0])) / p.spread / np.sqrt(size) for v, p in zip(x, own.values(), strict=True)]
        rest = target - _shown(situation, loops, group, values, single)
        return np.concatenate([rest[keep] * scale, prior])

    low = np.array([p.scaled(p.low) for p in own.values()])
    high = np.array([p.scaled(p.high) for p in own.values()])
    best = None
    for x in _starts(own, chosen, group[0]):
        found = least_squares(
            left, np.clip(x, low + 1e-9, high - 1e-9), bounds=(low, high), max_nfev=DESCENTS, x_scale="jac",
            diff_step=1e-3, xtol=1e-4, ftol=1e-5,
        )  # fmt: skip
        best = found if best is None or found.cost < best.cost else best
    assert best is not None
    before, after = float(np.sum((target[keep] * scale) ** 2)), 2.0 * float(best.cost)
    noise = float(keep.sum()) * scale**2
    values = {key: p.value(float(v)) for (key, p), v in zip(own.items(), best.x, strict=True)}
    size = independent(target - _shown(situation, loops, group, values, single)) if single else size
    worth = 0.5 * size * np.log((noise + before) / (noise + after))
    if worth < 0.5 * len(own) * np.log(max(size, 2.0)):
        return None
    return values


def _shown(
    situation: Situation,
    loops: Sequence[LoopExplanation],
    group: Sequence[int],
    values: Mapping[tuple[str, str], float],
    single: bool,
) -> Array:
    """What the sensor of one joint, or all of them, show of changed loops."""
    drive = situation.healthy
    for m in group:
        drive = _applied(situation, loops, drive, m, values)
    if not single:
        return situation.of_joints(situation.moved(drive) - situation.motion)
    m = group[0]
    k = situation.encoders[m]
    moved = situation.moved(drive, only=m)[0][:, 0] - situation.motion[0][:, m]
    shown = situation.weights[k] * np.interp(situation.sensors[k].times, situation.times, moved)
    return np.asarray(shown - shown.mean())


def _starts(
    own: Mapping[tuple[str, str], Parameter], chosen: Mapping[tuple[str, int], Mapping[str, float]], motor: int
) -> list[Array]:
    """Where the search begins: an earlier result, or all starts one after the other."""
    if all((cause, motor) in chosen for cause, _ in own):
        return [np.array([p.scaled(chosen[cause, motor][name]) for (cause, name), p in own.items()])]
    most = max(len(p.starts) for p in own.values())
    return [np.array([p.scaled(p.starts[min(k, len(p.starts) - 1)]) for p in own.values()]) for k in range(most)]
