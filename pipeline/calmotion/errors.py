"""The one kind of error that a user sees: what is wrong, where, and what to do."""

import contextlib
import errno
import os
import re
from collections.abc import Iterator, Sequence
from typing import Any


class ShotError(Exception):
    """A shot that cannot be processed.

    Printed as one message, and the command ends with exit status 1. Every place that refuses input raises
    this class, so a pipeline can read the fields instead of the text.

    Args:
        problem: What is wrong, as a sentence without a full stop.
        path: Prim path (or file) the problem is at; empty when it concerns the whole shot.
        attribute: Attribute or relationship name; empty when it is the prim itself.
        found: The value that was found, printed as it is.
        remedy: What the user can do about it, as an imperative sentence.
    """

    def __init__(self, problem: str, *, path: str = "", attribute: str = "", found: object = None, remedy: str = ""):
        self.problem = problem
        self.path = str(path)
        self.attribute = attribute
        self.found = found
        self.remedy = remedy
        super().__init__(self.message())

    def __reduce__(self) -> tuple[Any, ...]:
        """Errors travel between processes with all their fields; what was found, as its text."""
        fields = self.__dict__ | {"found": None if self.found is None else str(self.found)}
        return _restored, (type(self), self.args, fields)

    @property
    def place(self) -> str:
        """Where: prim path and attribute, as far as they are known; an option of the command stands first."""
        if self.path and self.attribute.startswith("--"):
            return f"{self.attribute}, for {self.path}"
        return ".".join(filter(None, (self.path, self.attribute)))

    def message(self) -> str:
        """The error as one line of text: place, problem, what was found, remedy."""
        text = f"{self.place}: {self.problem}" if self.place else self.problem
        if self.found is not None:
            text += f" (found {self.found})"
        return f"{text}. {self.remedy}" if self.remedy else f"{text}."

    def as_dict(self) -> dict[str, str]:
        """The fields, for `--json`."""
        return {
            "problem": self.problem,
            "path": self.path,
            "attribute": self.attribute,
            "found": "" if self.found is None else str(self.found),
            "remedy": self.remedy,
        }


def _restored(cls: type[ShotError], args: tuple[object, ...], fields: dict[str, Any]) -> ShotError:
    error = cls.__new__(cls, *args)
    error.__dict__.update(fields)
    return error


@contextlib.contextmanager
def file_access(problem: str, path: object, remedy: str) -> Iterator[None]:
    """A block that reads or writes a file; arguments as of `ShotError`.

    Raises:
        ShotError: The system refuses, with its reason.
    """
    try:
        yield
    except OSError as error:
        raise ShotError(problem, path=str(path), found=error.strerror or error, remedy=remedy) from error


# Parts of messages with which libraries say that memory or threads ran out, under exceptions of other kinds.
_EXHAUSTED = ("can't start new thread", "cannot allocate memory", "failed to map segment", "std::bad_alloc")


def failure_of_machine(error: BaseException, short: bool = False) -> ShotError | None:
    """The error that a user sees where memory or files of the machine failed; None for any other exception.

    Args:
        short: Whether memory was short: libraries then raise anything.
    """
    if isinstance(error, ShotError):
        return None
    text = str(error)
    number = _error_number(error)
    if number == errno.ENOMEM or isinstance(error, MemoryError) or any(part in text.lower() for part in _EXHAUSTED):
        return ShotError(
            "there is not enough memory",
            found=text or None,
            remedy="End other programs, raise the limit of memory, or choose a larger tolerance or element size",
        )
    if number is None and short:
        return ShotError(
            "there is not enough memory",
            found=f"{type(error).__name__}: {text}",
            remedy="Raise the limit of memory (ulimit -v)",
        )
    if number is not None:
        return ShotError(
            "a file cannot be read or written",
            path=str(getattr(error, "filename", None) or ""),
            found=os.strerror(number),
            remedy="Check free space, permissions and the folder",
        )
    return None


def _error_number(error: BaseException) -> int | None:
    """The system's number of an error; that of an exception of a Rust library stands in its text."""
    if isinstance(error, OSError):
        return error.errno
    found = re.search(r"\(os error (\d+)\)", str(error))
    return int(found[1]) if found else None


class IntegrationError(ShotError):
    """A simulation that failed with one time step or integrator, and may succeed with another."""


class ShotErrors(ShotError):
    """Several problems of one shot, found at once; its own fields are those of the first.

    Args:
        errors: Two or more.
    """

    def __init__(self, errors: Sequence[ShotError]):
        self.errors = tuple(errors)
        first = self.errors[0]
        super().__init__(
            first.problem, path=first.path, attribute=first.attribute, found=first.found, remedy=first.remedy
        )

    def message(self) -> str:
        """One line each."""
        return "\n".join(error.message() for error in self.errors)


def each(error: ShotError) -> tuple[ShotError, ...]:
    """The single problems of an error."""
    return error.errors if isinstance(error, ShotErrors) else (error,)


def raise_all(errors: Sequence[ShotError]) -> None:
    """Raise what was found, if anything, as one error."""
    single = [one for error in errors for one in each(error)]
    if len(single) == 1:
        raise single[0]
    if single:
        raise ShotErrors(single)
