"""What practitioners do instead: input shapers and low-pass filters on the motors' tracks.

A shaper convolves every track with a few impulses, timed so that a mode of known frequency and damping cancels its own
vibration (N. C. Singer, W. P. Seering, Preshaping command inputs to reduce system vibration, 1990): ZV with two, ZVD,
which also forgives an error of the frequency, with three. EI forgives a larger one, and leaves a twentieth where there
is none (W. Singhose, W. Seering, N. Singer, Residual vibration reduction using vector diagrams to generate shaped
inputs, 1994); MZV, of the printers' firmware Klipper, takes three quarters of a period where ZVD takes a whole one. A
shaper delays the motion and knows nothing of the targets.
"""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from calmotion.arrays import Array, BoolArray
from calmotion.errors import ShotError
from calmotion.model.run import SHAPERS
from calmotion.simulation.inputs.curves import Curves
from calmotion.simulation.inputs.time_grid import ORDERS, TimeGrid

LONGEST_DELAY = 0.6  # that is looked for [s]
TOLERANCE = 0.05  # share of the vibration that EI leaves
# at equal distances within a share of the damped period: amplitudes without damping
SHAPES = {
    "zv": ((1.0, 1.0), 0.5),
    "zvd": ((1.0, 2.0, 1.0), 1.0),
    "ei": ((1.0 + TOLERANCE, 2.0 * (1.0 - TOLERANCE), 1.0 + TOLERANCE), 1.0),
    "mzv": ((1.0 - np.sqrt(0.5), np.sqrt(2.0) - 1.0, 1.0 - np.sqrt(0.5)), 0.75),
}
SLOWEST = 1e-3  # frequency below which a mode moves freely, up to rounding [Hz]
CUTOFF = 0.5  # of the low-pass filter, over the lowest frequency, where nobody says


def vibrating(frequencies: Array, damping: Array) -> BoolArray:
    """Which modes of some frequencies [Hz] and ratios of critical damping swing: not free motions, such as the spin of
    a ball joint, nor those that are damped critically."""
    found: BoolArray = (frequencies > SLOWEST) & (damping < 1.0)
    return found


def impulses(kind: str, frequencies: Array, damping: Array) -> tuple[Array, Array]:
    """Times [s] and amplitudes, of sum one, of a shaper.

    Args:
        kind: One of `SHAPES` for the lowest mode that vibrates, with a 2 behind it for the lowest two.
        frequencies: Undamped, of the modes [Hz], ascending.
        damping: Their ratios of critical. Modes that do not swing are passed over, see `vibrating`.
    """
    times, amplitudes = np.zeros(1), np.ones(1)
    count = 2 if kind.endswith("2") else 1
    shape, share = SHAPES[kind.removesuffix("2")]
    vibrates = vibrating(frequencies, damping)
    for frequency, ratio in zip(frequencies[vibrates][:count], damping[vibrates][:count], strict=True):
        periods = share * np.linspace(0.0, 1.0, len(shape))
        own = shape * np.exp(-2.0 * np.pi * ratio / np.sqrt(1.0 - ratio**2) * periods)
        late = periods / (frequency * np.sqrt(1.0 - ratio**2))
        times = (times[:, None] + late).ravel()
        amplitudes = (amplitudes[:, None] * own / own.sum()).ravel()
    return times, amplitudes


def delay(kind: str, frequencies: Array, damping: Array) -> float:
    """Mean delay of a shaper [s]; none of a filter that runs both ways."""
    if kind == "lowpass":
        return 0.0
    times, amplitudes = impulses(kind, frequencies, damping)
    return float(times @ amplitudes)


def shaped(
    curves: Curves, grid: TimeGrid, kind: str, frequencies: Array, damping: Array, cutoff: float = CUTOFF
) -> Curves:
    """Curves through a shaper; before their first instant they rest.

    Raises:
        ShotError: There is no such shaper, or no frequency to shape for.
    """
    slow = frequencies[frequencies > SLOWEST]
    vibrates = len(slow) > 0 if kind == "lowpass" else bool(np.any(vibrating(frequencies, damping)))
    if kind not in SHAPERS or not vibrates:
        raise ShotError(
            "there is no such shaper" if vibrates else "a robot that does not vibrate has no frequency for a shaper",
            attribute="--shaper",
            found=kind,
            remedy=f"Use one of {', '.join(SHAPERS)}." if vibrates else "Leave it out.",
        )
    times = grid.times
    if kind == "lowpass":
        edge, highest = cutoff * slow[0], 0.5 / grid.h
        if not edge < highest:
            raise ShotError(
                "the cutoff of the low-pass filter is too high for the time step",
                attribute="retarget.shape.cutoff",
                found=f"{cutoff:g}, which is {edge:.4g} Hz, with steps of {1e3 * grid.h:.3g} ms",
                remedy=f"Use less than {highest / slow[0]:.3g}, or a smaller --step.",
            )
        sections = butter(2, edge, fs=1.0 / grid.h, output="sos")
        angles = sosfiltfilt(sections, curves.angles, axis=0, padtype="constant", padlen=min(len(times) - 1, 4000))
    else:
        source, angles = CubicSpline(times, curves.angles), np.zeros_like(curves.angles)
        for late, amplitude in zip(*impulses(kind, frequencies, damping), strict=True):
            angles += amplitude * source(np.maximum(times - late, times[0]))
    spline = CubicSpline(times, angles)
    return Curves((angles, *(spline(times, order) for order in range(1, ORDERS))))


def best_delay(positions: Array, intended: Array, judged: BoolArray | slice, h: float) -> tuple[float, Array]:
    """The delay of the intended motion from which a motion differs least, and the distances that are left.

    An input shaper delays the motion, and a comparison without the delay would count it as an error.

    Args:
        positions, intended: Of the targets, shape [T, K, 3] [m].
        judged: Instants that count, shape [T], or a slice of them.
        h: Step [s].

    Returns:
        The delay [s], at most `LONGEST_DELAY`, in steps of two milliseconds, and the distances, shape [t, K] [m].
    """
    instants = np.arange(len(positions))[judged]

    def distances(shift: int) -> Array:
        off: Array = np.linalg.norm(positions[instants] - intended[np.maximum(instants - shift, 0)], axis=2)
        return off

    shifts = range(0, max(1, int(LONGEST_DELAY / h)), max(1, int(0.002 / h)))
    best = min(shifts, key=lambda shift: float(distances(shift).max(initial=0.0)))
    return best * h, distances(best)
