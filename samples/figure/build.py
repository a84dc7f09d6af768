"""Builds figure.usda: `python samples/figure/build.py [FILE]`. The same script always writes the same bytes.

It is the character of two shots, drummer and boxer, whose layers reference this one; nothing animates it here.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
if str(HERE.parent) not in sys.path:
    sys.path.insert(0, str(HERE.parent))

from figure.model import FIGURE  # noqa: E402
from kit import character  # noqa: E402

if __name__ == "__main__":
    character.write(FIGURE, character.destination(HERE))
