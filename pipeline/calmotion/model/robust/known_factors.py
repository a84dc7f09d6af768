"""What a calibration that a shot carries tells of its robot."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class KnownFactors:
    """What a calibration tells of the factors by which parameters of the robot may differ from the shot.

    Attributes:
        names: Kind and path of each.
        covariance: Of the logarithms of the factors, by rows.
    """

    names: tuple[str, ...] = ()
    covariance: tuple[tuple[float, ...], ...] = field(default_factory=tuple)
