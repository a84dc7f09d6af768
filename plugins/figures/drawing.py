"""All figures of a result."""

from collections.abc import Callable, Iterator
from pathlib import Path

from calmotion.errors import file_access
from calmotion.model import Animation, Character, Result, SystemModes
from calmotion.views import save
from matplotlib.figure import Figure

from .curves import most_changed, plot_convergence, plot_errors, plot_motors
from .filmstrip import draw_filmstrip
from .robustness import plot_robustness
from .spectra import plot_spectra
from .tempo import plot_tempo

MOTORS_ON_A_PAGE = 8
Progress = Callable[[float, str], None]


def plots_of(
    character: Character, result: Result, modes: SystemModes | None = None
) -> Iterator[tuple[str, str, Figure]]:
    """The figures of curves: for each the name of its file, a heading, and the figure.

    Args:
        modes: Frequencies to mark in the spectra.
    """
    if character.targets:
        yield "errors", "Errors over time", plot_errors(character, result)
        yield "spectra", "Spectra of the errors", plot_spectra(character, result, modes)
    order = most_changed(character, result)
    for page, first in enumerate(range(0, len(order), MOTORS_ON_A_PAGE), start=1):
        motors = order[first : first + MOTORS_ON_A_PAGE]
        yield "motors" if page == 1 else f"motors_{page}", "Motors", plot_motors(character, result, motors)
    if len(result.search.steps) > 1:
        yield "convergence", "The search", plot_convergence(result)
    if result.retimed is not None and result.retimed.animation.tempo is not None:
        yield "tempo", "Tempo", plot_tempo(character, result.retimed)
    if result.robustness is not None and character.targets:
        yield "robustness", "Robots that differ from the model", plot_robustness(character, result.robustness)


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
    with file_access("the figures cannot be written", folder, "Choose another --figures."):
        target.mkdir(parents=True, exist_ok=True)
        for number, (name, heading, figure) in enumerate(plots_of(character, result, modes)):
            progress(min(0.1 * number, 0.45), heading)
            written.append(save(figure, target / f"{name}.png", dpi))
        progress(0.5, "filmstrip")
        written.append(save(draw_filmstrip(character, animation, result, instants), target / "filmstrip.png", dpi))
    return written
