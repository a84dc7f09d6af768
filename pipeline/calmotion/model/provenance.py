"""Origin and units of a shot."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class InputLayer:
    """A layer that was read: its path as a person would give it, and the SHA-256 of its bytes."""

    path: str
    sha256: str


@dataclass(frozen=True)
class Provenance:
    """Origin, units and range of the shot, for writing results.

    Attributes:
        shot: Path of the shot as given.
        layers: Every layer that was read, the shot first.
        meters_per_unit, kilograms_per_unit, up_axis: Of the stage, fallbacks applied.
        time_codes_per_second, frames_per_second, start_time_code, end_time_code: Of the stage.
        default_prim: Name of the default prim, or empty.
        earlier_layers: Layers of earlier results in the shot, which were muted to read the intended motion.
    """

    shot: str
    layers: tuple[InputLayer, ...]
    meters_per_unit: float
    kilograms_per_unit: float
    up_axis: str
    time_codes_per_second: float
    frames_per_second: float
    start_time_code: float
    end_time_code: float
    default_prim: str
    earlier_layers: tuple[str, ...] = ()
