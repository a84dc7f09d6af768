"""Where the command line prints: results on stdout, everything else on stderr."""

from __future__ import annotations

import json
import logging
import os
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TextIO

from calmotion.cli.tables import console_on, filled, with_texts
from calmotion.errors import ShotError, each, failure_of_machine
from calmotion.host import Host
from calmotion.support.memory import was_short
from calmotion.support.naming import as_written
from calmotion.workflow.problems import Problem, RunError
from calmotion.workflow.report import plain

if TYPE_CHECKING:
    from rich.console import Console

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
    stream = real = sys.stdout
    real.flush()
    sys.stdout = sys.stderr
    keeper = None
    try:
        if _descriptor(real) == 1 and _descriptor(sys.stderr) is not None:
            keeper = os.dup(1)
            os.dup2(sys.stderr.fileno(), 1)
            stream = os.fdopen(os.dup(keeper), "w", encoding=real.encoding)
        yield Output(stream, True)
    finally:
        with suppress(OSError):  # a failure is told by `object`, which flushes
            stream.flush() if keeper is None else stream.close()
        if keeper is not None:
            os.dup2(keeper, 1)
            os.close(keeper)
        sys.stdout = real


@contextmanager
def own_messages() -> Iterator[None]:
    """Print the warnings of Calmotion as sentences on stderr, and none of libraries, upon which a user cannot act.

    Where warnings are errors (`python -W error`), or an option of Python names those to show, they are left alone.
    """
    own, root = logging.getLogger("calmotion"), logging.getLogger()
    notices, silence = logging.Handler(), logging.NullHandler()  # without one at the root, Python prints on stderr
    notices.emit = lambda record: notice(f"{record.levelname.lower()}: {record.getMessage()}")  # type: ignore[method-assign]
    os.environ.setdefault("RUST_LOG", "off")  # rerun would print messages of its own besides its exceptions
    with warnings.catch_warnings():
        if not sys.warnoptions and all(action != "error" for action, *_ in warnings.filters):
            warnings.simplefilter("ignore")
        own.addHandler(notices)
        root.addHandler(silence)
        try:
            yield
        finally:
            own.removeHandler(notices)
            root.removeHandler(silence)


def _descriptor(stream: TextIO) -> int | None:
    try:
        return stream.fileno()
    except (OSError, ValueError, AttributeError):
        return None


def print_error(error: ShotError, output: Output) -> None:
    """Print an error: as the JSON object, or on stderr in lines for a person, also where stdout takes nothing."""
    _print_problems(error.problems if isinstance(error, RunError) else [Problem(one) for one in each(error)], output)


def print_fault(error: Exception, output: Output) -> None:
    """Print an exception that the program did not expect: what the machine lacks, or a fault with its traceback."""
    known = failure_of_machine(error, was_short())
    if known is not None:
        return print_error(known, output)
    found = "".join(traceback.format_exception_only(error)).strip()
    remedy = "Report it, with the traceback. Remove paths and names from it that are confidential"
    fault = ShotError("the program has a fault", found=found, remedy=remedy)
    _print_problems([Problem(fault, traceback="".join(traceback.format_exception(error)))], output)


def _print_problems(problems: Sequence[Problem], output: Output) -> None:
    try:
        conclude({}, problems, output)
    except OSError:
        with suppress(OSError):
            conclude({}, problems, Output(sys.stderr, False))


def conclude(
    report: Mapping[str, Any],
    problems: Sequence[Problem],
    output: Output,
    show: Callable[[dict[str, Any], Console], None] | None = None,
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
        names = report.get("written_names", {})
        show(with_texts(dict(report), lambda text: as_written(text, names)), console_on(output.stream))
    for problem in problems:
        if problem.traceback:
            print(problem.traceback, end="", file=sys.stderr)
        tell_error(problem.error)


def tell_failed_plugins(host: Host) -> None:
    """Report plugins that could not be loaded, each with its traceback; the run continues without them."""
    for plugin in host.failures():
        print(plugin.traceback, end="", file=sys.stderr)
        notice(f"warning: the plugin {plugin.id} is not used: {_named(plugin.error)}")


def _named(error: BaseException | None) -> str:
    """An error of a plugin; with its type, unless it is one of ours, whose text is whole."""
    return str(error) if error is None or isinstance(error, ShotError) else f"{type(error).__name__}: {error}"


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
    print(filled(text, sys.stderr, indent), file=sys.stderr, flush=True)
