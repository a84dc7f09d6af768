"""How the tempo of a shot may change: what the user asks for, and what cannot be."""

import numpy as np

from calmotion.errors import ShotError
from calmotion.model import Animation, Character
from calmotion.model.tempo import TempoSettings


def pinned_times(text: str, start: float, per_second: float) -> tuple[float, ...]:
    """Times of the animation [s], ascending, from time codes, or seconds after the first frame with an s.

    Args:
        text: With commas between them.
        start: Time code of the first frame.
        per_second: Time codes in a second.

    Raises:
        ShotError: A part of it is no number.
    """
    found = []
    for part in filter(None, (part.strip() for part in text.split(","))):
        try:
            value = float(part.removesuffix("s"))
        except ValueError:
            raise ShotError(
                "this is neither a time code nor seconds",
                attribute="--retime pin",
                found=part,
                remedy="Write time codes with commas between them, as pin=24,48,72, or seconds, as pin=1s,2s,3s.",
            ) from None
        found.append(value if part.endswith("s") else (value - start) / per_second)
    return tuple(np.unique(found).tolist())


def refuse_tempo(character: Character, animation: Animation, settings: TempoSettings) -> None:
    """Refuse shots whose tempo cannot change, and settings that fit no tempo.

    Raises:
        ShotError: It loops, it has another tempo already, or a setting is out of range.
    """
    path, end = character.path, float(animation.frame_times[-1])
    if character.retarget.cyclic:
        raise ShotError(
            "the tempo of a shot that loops cannot change",
            path=path,
            attribute="calm:retarget:cyclic",
            found=True,
            remedy="Set it to false and author some loops one after the other, or leave --retime out.",
        )
    if animation.tempo is not None:
        raise ShotError(
            "the shot has results at another tempo already",
            path=path,
            attribute="calm:retime:map",
            remedy="Name the shot beneath these results, or leave --retime out.",
        )
    for name, value, fits in (
        ("slowest", settings.slowest, 1.0 <= settings.slowest < np.inf),
        ("fastest", settings.fastest, 0.0 < settings.fastest <= 1.0),
    ):
        if not fits:
            raise ShotError(
                "this stretch is out of range",
                path=path,
                attribute=f"calm:retime:{name}",
                found=value,
                remedy="Use 1 or more for slowest, and more than 0 and at most 1 for fastest.",
            )
    outside = [time for time in settings.pinned if not 0.0 <= time <= end]
    if outside:
        raise ShotError(
            "a pinned time is outside of the shot",
            path=path,
            attribute="calm:retime:pinned",
            found=f"{outside[0]:.3f} s after the first frame, where the shot lasts {end:.3f} s",
            remedy="Name time codes of the animation, in the range of the shot.",
        )
