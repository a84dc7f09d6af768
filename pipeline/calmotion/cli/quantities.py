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


def about(meters: float | None) -> str:
    """An estimated length or error as text, to two digits."""
    return length(meters if meters is None or not math.isfinite(meters) else float(f"{meters:.2g}"))


def frequency(hertz: float) -> str:
    """A frequency in Hz to four digits, without its unit and without powers of ten."""
    return f"{float(f'{hertz:.4g}'):.10g}"


def angle(radians: float | None) -> str:
    """An angle as text in degrees; `-` when there is none."""
    if radians is None or not math.isfinite(radians):
        return "-"
    degrees = math.degrees(radians)
    if abs(radians) < LEAST_ANGLE:
        return "0°"
    return f"{degrees:.4g}°" if abs(degrees) < 9999.5 else f"{degrees:.0f}°"


def counted(count: int, noun: str) -> str:
    """A number of things: `1 frame`, `2 frames`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


# Larger and smaller units in which a value is told, largest first: (size in SI units, name).
SCALES = {
    "Pa": ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa")),
    "s": ((1.0, "s"), (1e-3, "ms")),
    "m": ((1.0, "m"), (1e-3, "mm")),
    "rad": ((math.pi / 180.0, "°"),),
}
FEWEST, MOST = 0, 7  # digits behind the point


def measured(value: float, deviation: float, unit: str) -> tuple[str, str]:
    """A value and its standard deviation, in SI, as texts in one unit and to two digits of the deviation.

    `1.5993e9, 4.9e6, "Pa"` is `1.5993 GPa`, `0.0049 GPa`.
    """
    size, name = _scale(max(abs(value), deviation), unit)
    scaled = deviation / size
    if not 0.0 < scaled < math.inf:
        return _with(f"{value / size:.5g}", name), "-"
    digits = min(max(1 - math.floor(math.log10(scaled)), FEWEST), MOST)
    rounded = round(value / size, digits) + 0.0  # no negative zero
    return _with(f"{rounded:.{digits}f}", name), _with(f"{scaled:.{digits}f}", name)


def quantity_in(value: float, unit: str, digits: int = 5) -> str:
    """A value in SI as text with its unit."""
    size, name = _scale(abs(value), unit)
    return _with("0" if abs(value) < 1e-12 else f"{value / size:.{digits}g}", name)


def _scale(largest: float, unit: str) -> tuple[float, str]:
    scales = SCALES.get(unit, ((1.0, unit),))
    return next((scale for scale in scales if largest >= scale[0]), scales[-1])


def _with(number: str, unit: str) -> str:
    return f"{number}{unit}" if unit == "°" else f"{number} {unit}".rstrip()
