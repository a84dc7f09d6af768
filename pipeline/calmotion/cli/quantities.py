"""Quantities as text for a person: never in powers of ten, never finer than rounding."""

from __future__ import annotations

import math

LEAST = 1e-7  # length that is told [m]; what is below is rounding
LEAST_ANGLE = 1e-7  # angle that is told [rad]


def length(meters: float | None) -> str:
    """A length or error as text in mm; `-` when it is not known."""
    if meters is None or not math.isfinite(meters):
        return "-"
    if 0.0 < abs(meters) < LEAST:
        return f"< {1000.0 * LEAST:g} mm"
    return f"{1000.0 * meters:.4g} mm" if abs(meters) < 9.9995 else f"{meters:.4g} m"


def angle(radians: float | None) -> str:
    """An angle as text in degrees; `-` when there is none."""
    if radians is None or not math.isfinite(radians):
        return "-"
    degrees = math.degrees(radians)
    if abs(radians) < LEAST_ANGLE:
        return "0°"
    return f"{degrees:.4g}°" if abs(degrees) < 9999.5 else f"{degrees:.0f}°"


def memory(size: float) -> str:
    """An amount of memory in bytes as text, to two digits."""
    for power, unit in ((9, "GB"), (6, "MB")):
        if size >= 0.995 * 10.0**power:
            return f"{_to_two_digits(size / 10.0**power)} {unit}"
    return "less than 1 MB"


def _to_two_digits(value: float) -> str:
    return f"{value:.2g}" if value < 99.5 else f"{round(value, -1):.0f}"


def counted(count: int, noun: str) -> str:
    """A number of things: `1 frame`, `2 frames`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
