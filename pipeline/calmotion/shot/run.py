"""Settings of a run, as the user gave them."""

from __future__ import annotations

from dataclasses import dataclass

INTEGRATORS = ("bdf2", "newmark", "generalized-alpha", "rk4", "radau")
SHAPERS = ("zv", "zvd", "zv2", "zvd2", "lowpass")  # input shapers and a filter


@dataclass(frozen=True)
class Source:
    """What the user asked for.

    Attributes:
        path: The shot.
        command: `inspect`, `simulate` or `optimize`.
        tolerance: Acceptable error at the targets [m], or None for the shot's.
        step: Time step [s], or None for automatic.
        integrator: Name of the integrator, or None for automatic.
        pre_roll: Length of the pre-roll [s], or None for automatic.
        shaper: Input shaper or filter through which `simulate` passes the motors' tracks first, or None.
        motion: File with a motion that replaces tracks of motors, or None.
        verify: Whether the result is to be compared with a finer run.
    """

    path: str
    command: str
    tolerance: float | None = None
    step: float | None = None
    integrator: str | None = None
    pre_roll: float | None = None
    shaper: str | None = None
    motion: str | None = None
    verify: bool = False


@dataclass(frozen=True)
class OutputPaths:
    """Where the results go; None: not asked for."""

    layer: str | None = None
    rrd: str | None = None
    csv: str | None = None
    figures: str | None = None
    modes: str | None = None
