"""Where the command line prints: results on stdout, everything else on stderr."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TextIO

from calmotion.cli.sentences import width_of, wrapped
from calmotion.errors import ShotError, each
from calmotion.host import Host
from calmotion.workflow.plain import plain
from calmotion.workflow.problems import Problem, RunError

FAILED, INTERRUPTED = 1, 130


@dataclass(frozen=True)
class Output:
    """The result's stream, and whether the result is a JSON object."""

    stream: TextIO
    json: bool

    def object(self, fields: Mapping[str, Any]) -> None:
        """Print the one JSON object of this command."""
        print(json.dumps(plain(fields), indent=2, allow_nan=False), file=self.stream, flush=True)


@contextmanager
def protected_stdout(as_json: bool) -> Iterator[Output]:
    """The stream for results; with `as_json`, all other output to stdout goes to stderr.

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
    conclude({}, error.problems if isinstance(error, RunError) else [Problem(one) for one in each(error)], output)


def conclude(
    report: Mapping[str, Any],
    problems: Sequence[Problem],
    output: Output,
    show: Callable[[dict[str, Any], TextIO], None] | None = None,
) -> None:
    """Print the report and the problems.

    Args:
        report: What was computed; empty when nothing was.
        problems: What went wrong.
        output: Where the report is printed.
        show: Prints the report for a person; None prints nothing.
    """
    if output.json:
        errors = [problem.as_dict() for problem in problems]
        output.object({**report, **({"error": errors[0], "errors": errors} if errors else {})})
        return
    if report and show:
        show(dict(report), output.stream)
    for problem in problems:
        if problem.traceback:
            print(problem.traceback, end="", file=sys.stderr)
        tell_error(problem.error)


def tell_failed_plugins(host: Host) -> None:
    """Report plugins that could not be loaded, each with its traceback; the run continues without them."""
    for plugin in host.failures():
        print(plugin.traceback, end="", file=sys.stderr)
        notice(f"warning: the plugin {plugin.id} is not used: {plugin.error}")


def tell_error(error: ShotError) -> None:
    """Print an error on stderr: the problem, then where, what was found, what to do."""
    lines = [f"error: {error.problem}"]
    lines += [f"  at:    {error.place}"] if error.place else []
    lines += [f"  found: {error.found}"] if error.found is not None else []
    lines += [f"  do:    {error.remedy}"] if error.remedy else []
    for line in lines:
        notice(line, indent=" " * 7 if line.startswith(" ") else "  ")


def notice(text: str, indent: str = "  ") -> None:
    """Print a sentence on stderr, wrapped on a terminal."""
    print(wrapped(text, width_of(sys.stderr), indent), file=sys.stderr, flush=True)
