"""Findings of the validation of a shot."""

from __future__ import annotations

from dataclasses import dataclass

ERROR, WARNING = "error", "warning"


@dataclass(frozen=True)
class Finding:
    """An error or a warning about a shot.

    Attributes:
        level: `error` (the shot cannot be processed, or USD calls it invalid) or `warning`.
        rule: Which rule found it, such as `usdPhysicsValidators:RigidBodyChecker`.
        path: Prim path, or file.
        attribute: Attribute or relationship, or empty.
        problem: As a sentence without a full stop.
        found: The value that was found, or empty.
        remedy: What to do, or empty where the rule is not ours and does not say.
    """

    level: str
    rule: str
    path: str
    attribute: str
    problem: str
    found: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class Findings:
    """All of them, errors first."""

    items: tuple[Finding, ...]
