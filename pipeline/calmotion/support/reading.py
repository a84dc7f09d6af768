"""Texts that users name: never a file for whose content a reader would wait for ever."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from calmotion.support.files import refuse_special


def read_text(path: str | Path) -> str:
    """The content of a UTF-8 text file.

    Raises:
        OSError: It cannot be read, or is a named pipe, a socket or a device.
        UnicodeDecodeError: It is not UTF-8.
    """
    refuse_special(path)
    return Path(path).read_text(encoding="utf-8")


def read_toml(path: str | Path) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        OSError: It cannot be read, or is a named pipe, a socket or a device.
        ValueError: It is not UTF-8, not TOML, or nested too deeply.
    """
    text = read_text(path)
    try:
        return tomllib.loads(text.removeprefix("\ufeff"))  # which editors of Windows write
    except RecursionError:
        raise ValueError("its values are nested too deeply") from None
