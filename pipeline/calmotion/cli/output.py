"""Where the command line prints: results on stdout, everything else on stderr."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TextIO

from calmotion.errors import ShotError, each


@dataclass(frozen=True)
class Output:
    """The result's stream, and whether the result is a JSON object."""

    stream: TextIO
    json: bool

    def object(self, fields: Mapping[str, Any]) -> None:
        """Print the one JSON object of this command."""
        print(json.dumps(plain(fields), indent=2, allow_nan=False), file=self.stream, flush=True)


@dataclass(frozen=True)
class Problem:
    """An error, and the operator and plugin it came from; `traceback` only where their author needs it."""

    error: ShotError
    operator: str = ""
    plugin: str = ""
    traceback: str = ""

    def as_dict(self) -> dict[str, str]:
        """The fields, for `--json`."""
        owner = {"operator": self.operator, "plugin": self.plugin, "traceback": self.traceback}
        return self.error.as_dict() | {key: value for key, value in owner.items() if value}

    def tell(self) -> None:
        """Print it on stderr."""
        if self.traceback:
            print(self.traceback, end="", file=sys.stderr)
        tell_error(self.error)


def plain(value: Any) -> Any:
    """`value` as JSON can hold it: NumPy as Python, and null for what is not a finite number."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


@contextmanager
def protected_stdout(as_json: bool) -> Iterator[Output]:
    """The stream for results; with `as_json`, whatever else prints to stdout goes to stderr instead.

    Native libraries print past `sys.stdout`, so the file descriptor is redirected as well.
    """
    if not as_json:
        yield Output(sys.stdout, False)
        return
    real = sys.stdout
    real.flush()
    sys.stdout = sys.stderr
    keeper = None
    try:
        stream = real
        if _descriptor(real) == 1 and _descriptor(sys.stderr) is not None:
            keeper = os.dup(1)
            os.dup2(sys.stderr.fileno(), 1)
            stream = os.fdopen(os.dup(keeper), "w", encoding=real.encoding)
        yield Output(stream, True)
        stream.flush()
        if keeper is not None:
            stream.close()
    finally:
        if keeper is not None:
            os.dup2(keeper, 1)
            os.close(keeper)
        sys.stdout = real


def _descriptor(stream: TextIO) -> int | None:
    try:
        return stream.fileno()
    except (OSError, ValueError, AttributeError):
        return None


def print_error(error: ShotError, output: Output) -> None:
    """Print an error: as the JSON object, or on stderr in lines for a person."""
    single = each(error)
    if output.json:
        output.object({"error": single[0].as_dict(), "errors": [one.as_dict() for one in single]})
    else:
        for one in single:
            tell_error(one)


def tell_error(error: ShotError) -> None:
    """Print an error on stderr: the problem, then where, what was found, what to do."""
    lines = [f"error: {error.problem}"]
    lines += [f"  at:    {error.place}"] if error.place else []
    lines += [f"  found: {error.found}"] if error.found is not None else []
    lines += [f"  do:    {error.remedy}"] if error.remedy else []
    print("\n".join(lines), file=sys.stderr, flush=True)
