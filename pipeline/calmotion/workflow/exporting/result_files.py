"""Files that are written of a result: none that its run has read."""

from __future__ import annotations

import os

from calmotion.model import Character, Provenance
from calmotion.workflow.outputs import refuse_layers, refuse_overwriting
from calmotion.workflow.run import Outcome


def no_input(outcome: Outcome, path: str | os.PathLike[str]) -> str:
    """The path of a file, unless the run of a result read it.

    Raises:
        SettingError: It did.
    """
    files = {"path": os.fspath(path)}
    refuse_overwriting(outcome.shot.inputs, files)
    refuse_layers(outcome.shot.path, outcome.require(Provenance), outcome.require(Character), files)
    return files["path"]
