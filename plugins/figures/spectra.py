"""Spectra of the errors before and after, with the natural frequencies of the character."""

from calmotion.model import Character, Result, SystemModes
from calmotion.views import LIMIT, SMALL, error_spectrum, highest_frequency, new_figure, tidy, titles
from matplotlib.figure import Figure

from .curves import SMALLEST, WIDTH, runs_of, worst_targets

DECADES = 5.0  # of the vertical axis
NEAR = 0.05  # of the width: least distance of two labels
ROOM = 1.15  # end of the axis over the highest significant frequency


def plot_spectra(character: Character, result: Result, modes: SystemModes | None) -> Figure:
    """Amplitude of the position error of each target [mm] by frequency [Hz]."""
    shown = worst_targets(character, result)
    names = titles([target.path for target in character.targets])
    figure = new_figure(WIDTH, 0.7 + 2.1 * len(shown))
    all_axes = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    end = 1.0
    for axes, k in zip(all_axes, shown, strict=True):
        largest = 0.0
        for simulation, color, line, name in runs_of(result):
            frequencies, amplitudes = error_spectrum(simulation.motion, result.reference, k)
            axes.semilogy(frequencies[1:], 1e3 * amplitudes[1:], line, color=color, linewidth=1.5, label=name)
            largest = max(largest, 1e3 * float(amplitudes.max(initial=0.0)))
            if simulation is result.before:
                end = max(end, ROOM * highest_frequency(frequencies, amplitudes))
        tidy(axes, "amplitude [mm]", names[character.targets[k].path])
        axes.set_ylim(max(largest, SMALLEST) * 10.0**-DECADES, 3.0 * max(largest, SMALLEST))
        axes.margins(x=0.0)
    marked = [] if modes is None else [float(f) for f in modes.frequencies if f < end]
    for axes in all_axes:
        axes.set_xlim(0.0, end)
        for n, frequency in enumerate(marked):
            label = mode_label(modes) if n == 0 else None
            axes.axvline(frequency, color=LIMIT, linewidth=1.0, linestyle=":", label=label)
        labelled = -end
        for frequency in (f for f in marked if f > 0.0):
            if frequency - labelled > NEAR * end:
                labelled = frequency
                place = {"xycoords": ("data", "axes fraction"), "xytext": (2, -2), "textcoords": "offset points"}
                look = {"fontsize": SMALL - 1.0, "color": LIMIT, "va": "top"}
                axes.annotate(f"{frequency:.1f}", (frequency, 1.0), **place, **look)
    # above the axes: inside, it would cover a curve or a mode
    all_axes[0].legend(
        fontsize=SMALL, loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=3, frameon=False, borderaxespad=0.0
    )
    all_axes[-1].set_xlabel("frequency [Hz]", fontsize=SMALL)
    return figure


def mode_label(modes: SystemModes | None) -> str:
    """Which pose the frequencies are those of."""
    if modes is None or modes.time_s <= 0.0:
        return "modes in the first pose"
    return f"modes in the pose at {modes.time_s:.2f} s (largest error)"
