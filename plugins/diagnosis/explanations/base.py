"""Bases of the explanations: those that change the loops of joints, and those that add to what sensors show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from calmotion.arrays import Array, BoolArray
from scipy.optimize import lsq_linear

from ..signals import Drive
from ..situation import Situation

Values = Mapping[str, float]


@dataclass(frozen=True)
class Parameter:
    """What is free in an explanation.

    Attributes:
        name, unit: As reported.
        starts: Where the search begins.
        low, high: Bounds.
        spread: Standard deviation about the first start before anything is measured; infinite: nothing is known.
        logarithmic: Whether it is searched by its logarithm, of which the spread then is.
    """

    name: str
    unit: str
    starts: tuple[float, ...]
    low: float
    high: float
    spread: float = np.inf
    logarithmic: bool = False

    def scaled(self, value: float) -> float:
        """As it is searched."""
        return float(np.log(value)) if self.logarithmic else value

    def value(self, scaled: float) -> float:
        """From what is searched."""
        return float(np.exp(scaled)) if self.logarithmic else scaled


@dataclass(frozen=True, eq=False)
class Effect:
    """What a fitted explanation does.

    Attributes:
        vector: Weighted, at the samples (`Situation.vector`).
        deviation: Of the joints, shape [3, T, M]; None for what does not move them.
        parameters: Rows of the report: `name`, `path`, `value`, `unit`.
        count: Number of values that were fitted.
        found: Where another search may begin.
    """

    vector: Array
    deviation: Array | None = None
    parameters: tuple[dict[str, Any], ...] = ()
    count: int = 0
    found: Array | None = None


@dataclass(frozen=True, eq=False)
class State:
    """What the joints do, as far as it is explained.

    Attributes:
        motion: Of the joints, shape [3, T, M].
        drive: How they are driven.
        kept: What an explanation computes once from both.
    """

    motion: Array
    drive: Drive
    kept: dict[str, Any] = field(default_factory=dict, repr=False)


class Explanation:
    """One cause of the error.

    Attributes:
        cause: Its name in reports.
        label: In a sentence: "... explains 80% of the error".
        tells: A measurement that separates it from others.
    """

    cause: ClassVar[str]
    label: ClassVar[str]
    tells: ClassVar[str]

    def applies(self, situation: Situation) -> bool:
        """Whether the recordings can show it at all."""
        return True

    def remedy(self, situation: Situation, parameters: Sequence[Mapping[str, Any]]) -> str:
        """What to do."""
        raise NotImplementedError


class LoopExplanation(Explanation):
    """Changes how each joint follows its command; fitted joint by joint where there are encoders."""

    def parameters(self, situation: Situation, motor: int) -> tuple[Parameter, ...]:
        """What is free in a joint."""
        raise NotImplementedError

    def changed(self, situation: Situation, drive: Drive, motor: int, values: Values) -> Drive:
        """The drives with these values of the parameters in a joint."""
        raise NotImplementedError


class AddedExplanation(Explanation):
    """Adds to what the sensors show; fitted to what others leave."""

    def effect(self, situation: Situation, state: State, error: Array, start: Effect | None) -> Effect:
        """What fits best.

        Args:
            state: What others explain of the joints.
            error: Weighted, that is to be explained.
            start: An earlier fit.
        """
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Columns:
    """Signals whose sizes are free within bounds.

    Attributes:
        vectors: Weighted, shape [p, N].
        low, high: Bounds of the sizes, shape [p].
    """

    vectors: Array
    low: Array = field(default_factory=lambda: np.array([-np.inf]))
    high: Array = field(default_factory=lambda: np.array([np.inf]))

    def sizes(self, error: Array, rows: BoolArray) -> Array:
        """That fit an error best in some rows, shape [p]."""
        A = self.vectors[:, rows].T
        Q, R = np.linalg.qr(A)
        keep = np.abs(np.diag(R)) > 1e-9 * max(np.abs(R).max(), 1e-300)
        sizes = np.clip(np.zeros(len(R)), self.low, self.high)
        if keep.all():
            bounds = (np.broadcast_to(self.low, sizes.shape), np.broadcast_to(self.high, sizes.shape))
            sizes = lsq_linear(R, Q.T @ error[rows], bounds).x
        return np.asarray(sizes)
