"""Which causes explain the error: sets of explanations, compared by what they predict of held-out samples."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from calmotion.arrays import Array

from .explanations.base import Explanation
from .explanations.joints import Backlash, Ripple
from .explanations.loops import Delay, Friction, ServoGains
from .explanations.stream import Stream
from .explanations.structure import Base, Links
from .fitting import Fit, fit, scores
from .formats import read_spectrum
from .ringing import peaks, ringing
from .situation import CLOSED, Situation

NONE, UNKNOWN = "none", "unknown"


def explanations() -> tuple[Explanation, ...]:
    """All that are known."""
    return Links(), ServoGains(), Backlash(), Friction(), Stream(), Delay(), Base(), Ripple()


@dataclass(frozen=True)
class Cause:
    """One cause of the error.

    Attributes:
        cause: `none`, `links`, `servo_gains`, `backlash`, `friction`, `stream`, `delay`, `base`, `ripple`, `unknown`.
        share: Of the error's energy, 0 to 1; shares of all causes add up to 1.
        confidence: Probability that it acts and is the largest, or for others that it acts.
        remedy: What to do.
        parameters: `name`, `path`, `value`, `unit` of what was fitted.
    """

    cause: str
    share: float
    confidence: float
    remedy: str
    parameters: tuple[Mapping[str, Any], ...] = ()


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What explains an error, the largest share first.

    Attributes:
        causes: The causes.
        tells: What further measurement would tell the first two apart.
        channels: `name`, `unit`, `error_rms`, `noise`, `unexplained_rms` of each.
        fit: The explanations as they were fitted; None where there is nothing to explain.
        situation: What was commanded and recorded; None of a spectrum.
    """

    causes: tuple[Cause, ...]
    tells: str
    channels: tuple[Mapping[str, Any], ...]
    fit: Fit | None
    situation: Situation | None

    @property
    def notes(self) -> tuple[str, ...]:
        """What was noticed."""
        return () if self.situation is None else self.situation.notes


class Comparison:
    """Fits sets of explanations and weighs them.

    Attributes:
        TEMPERATURE: By which differences of scores are divided: models are not exact, so that a likelihood exaggerates.
    """

    TEMPERATURE = 6.0
    PAIRED = 5  # so many of the best single explanations are tried together with the best one
    LEAST_SHARE = 0.03  # of the error's energy, of a cause that is reported
    QUIET, SMALL = 1.6, 3.0  # times the noise, of an error that is none, and of one that is none if nothing explains it
    MOSTLY = 0.7  # share that is not explained, from which on the cause is unknown
    WORTH = 3.0  # by which a score has to improve for one more explanation

    def __init__(self, situation: Situation, progress: Callable[[float], None] | None = None):
        self._situation, self._progress = situation, progress
        comparable = bool(situation.joints) and any(s.index >= 0 for s in situation.sensors)
        self._able = {e.cause: e for e in explanations() if comparable and e.applies(situation)}
        self._fits: dict[frozenset[str], Fit] = {}

    def diagnosis(self) -> Diagnosis:
        """The causes."""
        s = self._situation
        nothing = Fit({}, s.error, 0)
        if self._is_quiet(self.QUIET):
            quiet = Cause(NONE, 1.0, 0.95, "nothing: within the noise, the robot moves like a healthy one")
            return Diagnosis((quiet,), "", self._channels(nothing), None, s)
        self._fits[frozenset()] = nothing
        for k, cause in enumerate(self._able):
            self._fit(cause)
            if self._progress is not None:
                self._progress(0.6 * (k + 1) / len(self._able))
        ranked = self._scored()
        singles = sorted(self._able, key=lambda cause: ranked[frozenset([cause])])
        for cause in singles[1 : self.PAIRED] if singles else ():
            self._fit(singles[0], cause)
        best = self._best()
        for cause in singles[: self.PAIRED]:
            if len(best.causes) == 2 and cause not in best.causes:
                self._fit(*best.causes, cause)
        if self._progress is not None:
            self._progress(1.0)
        return self._concluded()

    def _fit(self, *causes: str) -> Fit:
        key = frozenset(causes)
        if key not in self._fits:
            ordered = [e for cause, e in self._able.items() if cause in key]
            alone = {c: self._fits[frozenset([c])].effects[c] for c in causes if frozenset([c]) in self._fits}
            self._fits[key] = fit(self._situation, ordered, alone)
        return self._fits[key]

    def _best(self) -> Fit:
        """The fit of the best score; a larger one has to be better by more than chance."""
        ranked = self._scored()
        return self._fits[min(ranked, key=lambda key: ranked[key] + self.WORTH * len(key))]

    def _scored(self) -> dict[frozenset[str], float]:
        """Score of each set of causes."""
        found = scores(self._situation, list(self._fits.values()))
        return dict(zip(self._fits, found.tolist(), strict=True))

    def _concluded(self) -> Diagnosis:
        best = self._best()
        if not best.causes and self._is_quiet(self.SMALL):
            quiet = Cause(NONE, 1.0, 0.7, "nothing: the rest is a little more than noise, and no cause explains it")
            return Diagnosis((quiet,), "", self._channels(best), None, self._situation)
        shares = self._shares(best)
        unexplained = max(0.0, 1.0 - sum(shares.values()))
        chances = self._chances()
        order = sorted(shares, key=lambda cause: -shares[cause])
        causes = []
        for place, cause in enumerate(order):
            if shares[cause] < self.LEAST_SHARE:
                continue
            effect = best.effects[cause]
            sure = chances[0 if place == 0 else 1].get(cause, 0.0) * min(1.0, (1.0 - unexplained) / 0.7)
            told = self._able[cause].remedy(self._situation, effect.parameters) if effect.parameters else ""
            causes.append(Cause(cause, shares[cause], sure, told, effect.parameters))
        unexplained = 1.0 - sum(cause.share for cause in causes)
        if unexplained >= self.LEAST_SHARE:
            rest = Cause(UNKNOWN, unexplained, 1.0, self._advice(), ringing(self._situation, best.left))
            # a cause that is found stands before what is not explained, unless that is nearly all
            causes.insert(len(causes) if unexplained < self.MOSTLY else 0, rest)
        return Diagnosis(tuple(causes), self._tells(best), self._channels(best), best, self._situation)

    def _is_quiet(self, times: float) -> bool:
        """Whether the error of each sensor is below so many times its noise."""
        s = self._situation
        rows = [np.concatenate([s.error[s.blocks[b]] for b in own]) for own in s.blocks_of]
        return all(float(np.sqrt(np.mean(row**2))) < times for row in rows)

    def _importance(self) -> Array:
        """Weight of each block in shares: the part of its error that is not noise, each sensor with its largest."""
        s = self._situation
        power = np.array([float(np.mean(s.error[block] ** 2)) for block in s.blocks])
        out = np.zeros(len(power))
        for own in s.blocks_of:
            total = power[own].sum()
            above = max(0.0, 1.0 - len(own) * self.QUIET**2 / max(total, 1e-12))
            out[own] = above * power[own] / max(total, 1e-12)
        return np.asarray(out / max(out.sum(), 1e-12))

    def _shares(self, best: Fit) -> dict[str, float]:
        """Share of each cause in the energy of the error, averaged over the sensors that show one."""
        s, found = self._situation, dict.fromkeys(best.causes, 0.0)
        for weight, block in zip(self._importance(), s.blocks, strict=True):
            error = s.error[block]
            energy = float(error @ error)
            if not weight or not energy:
                continue
            explained = max(0.0, 1.0 - float(best.left[block] @ best.left[block]) / energy)
            parts = {c: max(0.0, float(e.vector[block] @ error) / energy) for c, e in best.effects.items()}
            total = sum(parts.values())
            for cause, part in parts.items():
                found[cause] += weight * explained * part / total if total else 0.0
        return found

    def _chances(self) -> tuple[dict[str, float], dict[str, float]]:
        """Chance of each cause to be the largest, and to act, over all fits."""
        fits, ranked = list(self._fits.values()), self._scored()
        worth = np.array([value + self.WORTH * len(key) for key, value in ranked.items()])
        weights = np.exp(-(worth - worth.min()) / self.TEMPERATURE)
        weights /= weights.sum()
        first, acts = dict.fromkeys(self._able, 0.0), dict.fromkeys(self._able, 0.0)
        for f, weight in zip(fits, weights, strict=True):
            if not f.causes or weight < 1e-6:
                continue
            shares = self._shares(f)
            first[max(shares, key=lambda cause: shares[cause])] += weight
            for cause, share in shares.items():
                acts[cause] += weight * (share >= self.LEAST_SHARE)
        return first, acts

    def _tells(self, best: Fit) -> str:
        """The measurement that separates the first cause from the next best one."""
        first = self._chances()[0]
        order = sorted(first, key=lambda cause: -first[cause])
        shares = self._shares(best)
        top = max(shares, key=lambda cause: shares[cause]) if shares else (order[0] if order else "")
        other = next((cause for cause in order if cause != top), "")
        if not top or not other:
            return ""
        return f"to tell {self._able[top].label} from {self._able[other].label}: {self._able[top].tells}"

    def _advice(self) -> str:
        s = self._situation
        if CLOSED in s.notes:
            return "record all joints' encoders: of this robot, they alone can be compared with the motion"
        if s.mechanics is None:
            return "name the shot of the robot: its inertias and modes tell joints, links and base apart"
        if not s.encoders:
            return "record the joints' encoders too: they separate joints from structure"
        return "no explanation fits: record the hand with an accelerometer, and the same motion at half of its speed"

    def _channels(self, best: Fit) -> tuple[dict[str, Any], ...]:
        s, rows = self._situation, []
        for sensor, noise, weight, own in zip(s.sensors, s.noises, s.weights, s.blocks_of, strict=True):
            error, left = (
                float(np.sqrt(np.mean(np.concatenate([v[s.blocks[b]] for b in own]) ** 2))) / weight
                for v in (s.error, best.left)
            )
            unit = sensor.error_unit
            rows.append(
                {"name": sensor.name, "unit": unit, "error_rms": error, "noise": noise, "unexplained_rms": left}
            )
        return tuple(rows)


def of_spectrum(file: str) -> Diagnosis:
    """What a table of resonances alone says: where it rings.

    Raises:
        ShotError: It cannot be read.
    """
    rows = tuple(peaks(*read_spectrum(file), path=""))
    told = "record encoders and an accelerometer during a motion, and name the robot's shot: a spectrum has no cause"
    return Diagnosis((Cause(UNKNOWN, 1.0, 1.0, told, rows),), "", (), None, None)


def diagnosis_of(situation: Situation, progress: Callable[[float], None] | None = None) -> Diagnosis:
    """What explains the error of a situation."""
    return Comparison(situation, progress).diagnosis()
