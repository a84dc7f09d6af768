"""The standard streams of the process, also where who started it closed them."""

from __future__ import annotations

import os
import sys


def open_closed_streams() -> None:
    """Open standard streams that are closed on the null device.

    Python has None for them then, and the next file that is opened gets the number of the stream: what a library prints
    would go into that file.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number
    for name, number in (("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w", encoding="utf-8", errors="replace", closefd=False))
