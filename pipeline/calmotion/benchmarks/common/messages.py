"""What a benchmark tells the person who waits for it."""

from __future__ import annotations

import sys


def say(text: str) -> None:
    """Print a line beside what the benchmark prints as its result."""
    print(text, file=sys.stderr, flush=True)
