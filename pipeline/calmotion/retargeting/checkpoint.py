"""State of a search on disk: written atomically, and read only for the same problem and the same code."""

from __future__ import annotations

import contextlib
import hashlib
import json
import zipfile
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.solver.gauss_newton import Iterate, Search
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.shot.character import BoolArray, IntArray
from calmotion.support.files import replaced
from calmotion.support.sources import source_digest

# The state of a search belongs to the code that computed it.
_ROOMS = ("linear_algebra", "multibody", "retargeting", "simulation", "support")
_OF_LIMITS = ("rho", "left", "reached", "stalled", "on")


def checkpoint_path(layer: str) -> Path:
    """The file beside a layer that contains the state of its optimisation."""
    path = Path(layer)
    return path.with_name(f".{path.name}.checkpoint.npz")


def problem_key(problem: RetargetProblem, fixed: BoolArray, settings: object) -> str:
    """Hash of all inputs of a search and of the sources of the engine."""
    digest = hashlib.sha256(f"{source_digest(*_ROOMS)} {settings!r}".encode())
    space, curves, objective = problem.space, problem.curves, problem.objective
    intended = objective.intended
    arrays: list[Any] = [np.asarray(part) for part in problem.model.system]
    arrays += [curves.angles, curves.rates, curves.accelerations]
    arrays += [space.basis.values.data, space.basis.knots, space.coupling, fixed, space.smoothness, space.closeness]
    arrays += [objective.weights, intended.target_positions, intended.target_rotations]
    if problem.world is not None:
        arrays.append(problem.world)
    if problem.limits is not None:
        for bound in problem.limits.bounds.values():
            arrays += [bound.lower, bound.upper]
    for array in map(np.asarray, arrays):
        digest.update(str((array.shape, array.dtype)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """The state of the search of one problem in one file; without a path nothing is written.

    Attributes:
        path: The file.
        key: Of the problem.
    """

    path: Path | None
    key: str

    def save(self, search: Search, limits: LimitTerms | None, breaks: IntArray) -> None:
        """Write the state. If the folder cannot be written, nothing happens and the run continues."""
        if self.path is None:
            return
        values: dict[str, Any] = {
            "x": search.x, "breaks": breaks, "p": search.recycled.p, "Hp": search.recycled.Hp,
            "history": np.array([astuple(iterate) for iterate in search.history], float),
        }  # fmt: skip
        state: dict[str, object] = {
            "key": self.key, "radius": search.radius, "evaluations": search.evaluations, "gradients": search.gradients,
            "products": search.products, "reason": search.reason,
        }  # fmt: skip
        if limits is not None:
            state |= {name: getattr(limits, name) for name in _OF_LIMITS}
            values |= {f"limit {name}": y for name, y in limits.multipliers.items()}
        values["state"] = np.frombuffer(json.dumps(state).encode(), np.uint8)
        with contextlib.suppress(OSError), replaced(self.path) as temporary:
            np.savez(temporary, **values)

    def load(self, limits: LimitTerms | None) -> tuple[Search, IntArray] | None:
        """The stored search and the frames of its knots; None if the file has no state of this problem.

        The stored multipliers are written into the limits.
        """
        if self.path is None:
            return None
        try:
            with np.load(self.path, allow_pickle=False) as file:
                values = {name: file[name] for name in file.files}
            state = json.loads(values["state"].tobytes())
            if state["key"] != self.key:
                return None
            rows = values["history"].tolist()
            history = tuple(Iterate(row[0], row[1], row[2], int(row[3]), int(row[4])) for row in rows)
            search = Search(
                values["x"], state["radius"], Recycled(values["p"], values["Hp"]), history, state["evaluations"],
                state["gradients"], state["products"], state["reason"],
            )  # fmt: skip
            if limits is not None:
                limits.multipliers = {name: values[f"limit {name}"] for name in limits.bounds}
                for name in _OF_LIMITS:
                    setattr(limits, name, state[name])
        except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
            return None
        return search, values["breaks"]
