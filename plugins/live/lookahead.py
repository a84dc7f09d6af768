"""What a look-ahead is worth to a robot: the motion of its shot as a stream, played by the whole simulated robot."""

from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.model import RunSettings
from calmotion.simulation import CompiledShot, modes_of, prepare, vibrating

from .settings import LONGEST, LiveSettings
from .trial import Trial


@dataclass(frozen=True)
class Worth:
    """What one look-ahead leaves.

    Attributes:
        lookahead_s: [s]; None: the samples are sent as they come.
        latency_s: How much later than its sample the robot does what was asked [s].
        rms_m, largest_m: Distance of the targets from the delayed intended motion with the sag of each pose [m].
        limited: At how many ticks a joint was at a limit, by its path.
        tick_s: Median time of a tick on this machine [s].
    """

    lookahead_s: float | None
    latency_s: float
    rms_m: float
    largest_m: float
    limited: dict[str, int]
    tick_s: float


def worth_of_lookahead(shot: CompiledShot, settings: LiveSettings | None = None) -> tuple[list[Worth], tuple[str, ...]]:
    """Without calming, then with look-aheads from 20 ms to the longest period of the robot, at most 5 s.

    Args:
        shot: The robot; its animation is the stream.
        settings: Rate and uncertainty.

    Returns:
        A row for each look-ahead, and what is left out for this robot.

    Raises:
        ShotError, SettingError: As of `Live`.
    """
    shortest, rows = 0.02, 6
    settings = settings or LiveSettings()
    prepared = prepare(shot, RunSettings())
    trial, (frequencies, damping) = Trial(prepared), modes_of(prepared)
    rms, largest = _errors(shot, trial.left(trial.curves.angles, trial.curves.rates, 0.0)[1])
    found, notes = [Worth(None, 0.0, rms, largest, {}, 0.0)], []
    periods = 1.0 / frequencies[vibrating(frequencies, damping)]
    longest = float(np.clip(periods.max(initial=shortest), shortest, LONGEST))
    for lookahead in np.unique(np.geomspace(shortest, longest, rows).round(3)).tolist():
        angles, rates, report = trial.streamed(shot, replace(settings, lookahead=lookahead))
        rms, largest = _errors(shot, trial.left(angles, rates, report["latency_s"])[1])
        found.append(Worth(lookahead, report["latency_s"], rms, largest, report["limited"], report["tick_s"]["median"]))
        notes = report["notes"]
    return found, tuple(notes)


def _errors(shot: CompiledShot, distances: Array) -> tuple[float, float]:
    """Root mean square and largest distance of the targets that count [m]."""
    counted = distances[:, shot.model.targets.position_weight > 0.0]
    return (float(np.sqrt(np.mean(counted**2))), float(counted.max())) if counted.size else (0.0, 0.0)


def cells(rows: list[Worth]) -> list[tuple[str, ...]]:
    """The table for a person, without heads."""
    return [
        (
            "as sent" if row.lookahead_s is None else f"{1e3 * row.lookahead_s:.0f} ms",
            f"{1e3 * row.latency_s:.0f} ms",
            f"{1e3 * row.rms_m:.3g} mm",
            f"{1e3 * row.largest_m:.3g} mm",
            _limits(row.limited),
        )
        for row in rows
    ]


def _limits(limited: dict[str, int]) -> str:
    if not limited:
        return ""
    path = max(limited, key=lambda one: limited[one])
    others = f" and {len(limited) - 1} more" if len(limited) > 1 else ""
    return f"{path.rpartition('/')[2]} at a limit for {limited[path]} ticks{others}"
