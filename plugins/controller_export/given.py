"""What the user of an export gave: format, rate, delay and lengths, refused where no controller or shot has them."""

from dataclasses import dataclass
from numbers import Real

from calmotion.errors import ShotError
from calmotion.host import SettingError, quantity_of
from calmotion.model import Animation, Character, RunSettings
from calmotion.simulation import refuse_unsupported

from .commands import HIGHEST_RATE, LOWEST_RATE


@dataclass(frozen=True)
class GivenExport:
    """What the user gave: format, rate [Hz], delay [s], tolerance of the simulation [m], loss that is accepted [m]."""

    format: str
    rate: float
    delay: float
    tolerance: float | None
    allowed_loss: float | None


def given_export(
    to: str,
    rate: float,
    start_delay: float | str = 0.0,
    tolerance: float | str | None = None,
    allowed_loss: float | str | None = None,
) -> GivenExport:
    """The arguments of an export in SI units.

    Args:
        to: Name of the format.
        rate: Commands a second [Hz].
        start_delay: [s], or text with a unit.
        tolerance: Of the simulation [m], or text with a unit; None: the shot's own.
        allowed_loss: [m], or text with a unit; None: the tolerance.

    Raises:
        SettingError: One does not fit.
    """
    if not isinstance(rate, Real) or not LOWEST_RATE <= float(rate) <= HIGHEST_RATE:
        raise SettingError(
            f"the rate must be {LOWEST_RATE:g} to {HIGHEST_RATE:g} commands a second",
            path="--rate",
            found=rate,
            remedy="Use another rate.",
        )
    delay = quantity_of(start_delay, "s", "start_delay") or 0.0
    if delay < 0.0:
        raise SettingError(
            "the start delay must not be negative", path="--start-delay", found=start_delay, remedy="Use 5ms."
        )
    lengths = quantity_of(tolerance, "m", "tolerance"), quantity_of(allowed_loss, "m", "allowed_loss")
    if lengths[1] is not None and not lengths[1] > 0.0:
        raise SettingError(
            "the allowed loss must be positive", path="--allowed-loss", found=allowed_loss, remedy="Use 1mm."
        )
    return GivenExport(to, float(rate), delay, *lengths)


def refuse_beyond_format(highest: float, given: GivenExport) -> None:
    """Refuse a rate that the player of the format does not take.

    Args:
        highest: Commands a second that it takes [Hz].

    Raises:
        SettingError: The rate is higher.
    """
    if given.rate > highest:
        raise SettingError(
            f"the player of {given.format} takes at most {highest:g} commands a second",
            path="--rate",
            found=given.rate,
            remedy=f"Use {highest:g} or less.",
        )


def refuse_beyond_shot(character: Character, animation: Animation, given: GivenExport) -> None:
    """Refuse a tolerance that no simulation of the shot supports, and a start after its end.

    Raises:
        ShotError: Either.
    """
    refuse_unsupported(character, animation, RunSettings(tolerance=given.tolerance))
    end = float(animation.frame_times[-1])
    if given.delay > end:
        raise ShotError(
            "the controller would start after the end of the shot",
            path=character.path,
            attribute="--start-delay",
            found=f"{given.delay:g} s, where the shot lasts {end:g} s",
            remedy="Use a delay that a controller has, such as 5ms.",
        )
