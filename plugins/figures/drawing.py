"""All figures of a result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from calmotion.errors import ShotError
from calmotion.model import Animation, Character, Result, SystemModes
from calmotion.views import save

from .curves import plot_convergence, plot_errors, plot_motors
from .filmstrip import draw_filmstrip
from .robustness import plot_robustness
from .spectra import plot_spectra
from .tempo import plot_tempo

MOTORS_ON_A_PAGE = 8
Progress = Callable[[float, str], None]


def draw_figures(
    folder: str,
    character: Character,
    animation: Animation,
    result: Result,
    *,
    modes: SystemModes | None = None,
    dpi: int = 150,
    instants: int = 5,
    progress: Progress = lambda fraction, message: None,
) -> list[str]:
    """Draw the figures of a result.

    Args:
        folder: Folder of the figures; it is created where it does not exist.
        character: The character.
        animation: For the times of its frames.
        result: Of `simulate` (without figures of the optimiser) or of `optimize`.
        modes: Frequencies to mark in the spectra.
        dpi: Dots per inch.
        instants: Number of instants in the filmstrip.
        progress: Called with a fraction in 0..1 and a message.

    Returns:
        Paths of the figures.

    Raises:
        ShotError: When the folder cannot be written.
    """
    target = Path(folder)
    written: list[str] = []
    try:
        target.mkdir(parents=True, exist_ok=True)
        if character.targets:
            progress(0.0, "errors")
            written.append(save(plot_errors(character, result), target / "errors.png", dpi))
            progress(0.1, "spectra")
            written.append(save(plot_spectra(character, result, modes), target / "spectra.png", dpi))
        for page, first in enumerate(range(0, len(character.motors), MOTORS_ON_A_PAGE)):
            progress(0.2, "motors")
            motors = range(first, min(first + MOTORS_ON_A_PAGE, len(character.motors)))
            name = "motors.png" if page == 0 else f"motors_{page + 1}.png"
            written.append(save(plot_motors(character, result, motors), target / name, dpi))
        if len(result.steps) > 1:
            progress(0.4, "convergence")
            written.append(save(plot_convergence(result), target / "convergence.png", dpi))
        if result.retimed is not None and result.retimed.animation.tempo is not None:
            written.append(save(plot_tempo(character, result.retimed), target / "tempo.png", dpi))
        if result.robustness is not None and character.targets:
            progress(0.45, "robustness")
            written.append(save(plot_robustness(character, result.robustness), target / "robustness.png", dpi))
        progress(0.5, "filmstrip")
        written.append(save(draw_filmstrip(character, animation, result, instants), target / "filmstrip.png", dpi))
    except OSError as error:
        raise ShotError(
            f"the figures cannot be written: {error}", path=folder, remedy="Choose another --figures."
        ) from error
    return written
