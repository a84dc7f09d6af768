"""How far motors go within their limits."""

from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class LimitUse:
    """How far a motor goes within one of its limits, and what the limit costs.

    Attributes:
        motor: Motor index.
        quantity: Name of the kind of limit.
        limit: In SI.
        before, after: The value of the input and of the result that comes closest to the limit or exceeds it most.
        time_s: When, in the result [s].
        excess: (after - limit) over the size of the limit: positive where it is exceeded.
        cost_m: By how much the root-mean-square error would fall without the limit; None where it does not bind.
    """

    motor: int
    quantity: str
    limit: float
    before: float
    after: float
    time_s: float
    excess: float
    cost_m: float | None = None


@dataclass(frozen=True)
class TermUse:
    """What the quantity of a plugin's residual or limit is.

    Attributes:
        name, unit: Of the quantity.
        label: What the number belongs to; empty where there is only one.
        before, after: With the curves of the input and of the result, in SI: the root mean square over time of a
            residual, and of a limit the value that comes closest to it or exceeds it most.
        limit: In SI; None for a residual.
        time_s: When, in the result [s].
        excess: (after - limit) over the size of the limit: positive where it is exceeded.
    """

    name: str
    unit: str
    label: str
    before: float
    after: float
    limit: float | None = None
    time_s: float = 0.0
    excess: float = 0.0


_REACHED = 1e-3  # of the size of a limit: what is nearer touches it
_KEPT = 1e-3  # of the size of a limit: what exceeds it by less keeps it
_ROUNDING = 1e-6  # of the size of a limit


def is_reached(limit: LimitUse | TermUse) -> bool:
    """Whether a quantity goes up to a limit, or the limit costs something; not whether there merely is one."""
    costs = isinstance(limit, LimitUse) and limit.cost_m is not None
    return costs or limit.excess > -_REACHED


def is_kept(limit: LimitUse | TermUse) -> bool:
    """Whether a quantity keeps a limit, as well as a search can say."""
    return limit.excess <= _KEPT


def is_exceeded(limit: LimitUse | TermUse) -> bool:
    """Whether a quantity goes beyond a limit, by more than rounding."""
    return limit.excess > _ROUNDING
