"""Messages of USD: none reaches stderr; those that say something about the shot become notes that name the prim."""

import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from pxr import Usd, UsdUtils

_CIRCUMSTANCES = re.compile(r" \((?:instantiating|recomposing|composing) stage on stage @.*\)$")
_SESSION = re.compile(r",@anon:[^@]*-session[^@]*@")


@contextmanager
def quiet() -> Iterator[list[str]]:
    """Suppress USD's messages on stderr; errors are raised as ShotErrors instead.

    Yields:
        A list that has the messages, each once in one line, when the block has ended.
    """
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    messages: list[str] = []
    try:
        yield messages
    finally:
        found = (one_line(diagnostic.commentary) for diagnostic in delegate.TakeUncoalescedDiagnostics())
        messages += dict.fromkeys(found)
        del delegate


def one_line(text: str) -> str:
    """A message of USD in one line, without what says nothing to a user: addresses and layers of the session."""
    line = " ".join(text.split())
    return _SESSION.sub("", _CIRCUMSTANCES.sub("", line))


def with_places(messages: Iterable[str], stage: Usd.Stage, prims: Iterable[Usd.Prim]) -> list[tuple[str, str]]:
    """Each message, as a sentence for the user, with the prim or file that it is about.

    Args:
        messages: Those of `quiet`.
        stage: The stage that they are about.
    """
    places = list(prims) if messages else []
    return [(_place(message, stage, places), f"USD reports: {message}") for message in messages]


def _place(message: str, stage: Usd.Stage, prims: list[Usd.Prim]) -> str:
    """The prim that a message is about, or the shot where it names none."""
    site = re.search(r"(?:<| )(/[\w/]+)", message)
    if site and stage.GetPrimAtPath(site[1]):
        return site[1]
    schema, asset = re.search(r"API schema '([^']+)'", message), re.search(r"clip layer @([^@]*)@", message)
    for prim in prims:
        if schema and schema[1] in prim.GetPrimTypeInfo().GetAppliedAPISchemas():
            return str(prim.GetPath())
        if asset and asset[1] in str(prim.GetMetadata("clips")):
            return str(prim.GetPath())
    return str(stage.GetRootLayer().identifier)
