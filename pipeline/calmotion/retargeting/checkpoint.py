"""State of a search on disk: written atomically, verified, and read only for the same problem and the same code."""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.arrays import BoolArray, IntArray
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.retargeting.solver.gauss_newton import Iterate, Search
from calmotion.retargeting.solver.preconditioner import Sharpened
from calmotion.retargeting.solver.recycling import Recycled
from calmotion.support.caching.sources import source_digest
from calmotion.support.caching.verified_files import DamagedFileError, read_arrays, write_arrays

# The state of a search belongs to the code that computed it.
_ROOMS = ("linear_algebra", "multibody", "retargeting", "simulation", "support")
_OF_LIMITS = ("rho", "first", "left", "reached", "stalled", "on")
MERIT_ROUNDING = 1e-4  # largest relative difference of the merit when a stored point is simulated again
LOG = logging.getLogger("calmotion")


def checkpoint_path(layer: str) -> Path:
    """The file beside a layer that contains the state of its optimisation."""
    path = Path(layer)
    return path.with_name(f".{path.name}.checkpoint.npz")


def remove_checkpoint(path: Path) -> None:
    """Remove the file after the search; a folder in its place, or a file that cannot be removed, is left alone."""
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)


def problem_key(problem: RetargetProblem, fixed: BoolArray, settings: object) -> str:
    """Hash of all inputs of a search and of the sources of the engine."""
    digest = hashlib.sha256(f"{source_digest(*_ROOMS)} {settings!r}".encode())
    space, curves, objective = problem.space, problem.curves, problem.objective
    intended = objective.intended
    arrays: list[Any] = [np.asarray(part) for robot in problem.robots for part in (*robot.model.system, robot.weight)]
    arrays += curves.derivatives
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
class StoredSearch:
    """A search as it was stored.

    Attributes:
        search: Its state.
        breaks: Frames of its knots.
        merit: At its point, with the multipliers of its limits.
        limits: Multipliers and state of its limits, by name; empty without limits.
    """

    search: Search
    breaks: IntArray
    merit: float
    limits: dict[str, Any]

    def matches(self, merit: float) -> bool:
        """Whether the point has the recorded merit when it is simulated again."""
        return bool(np.isfinite(merit) and abs(merit - self.merit) <= MERIT_ROUNDING * max(abs(self.merit), abs(merit)))

    def restored(self, limits: LimitTerms | None) -> LimitTerms | None:
        """Limits in the stored state."""
        return None if limits is None else replace(limits, **self.limits)


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """The state of the search of one problem in one verified file; without a path nothing is written.

    Attributes:
        path: The file.
        key: Of the problem.
    """

    path: Path | None
    key: str

    def save(self, search: Search, limits: LimitTerms | None, breaks: IntArray, merit: float) -> None:
        """Write the state. If the folder cannot be written, nothing happens and the run continues.

        Args:
            merit: At the point of the search.
        """
        if self.path is None:
            return
        values: dict[str, Any] = {
            "x": search.x, "breaks": breaks, "p": search.recycled.p, "Hp": search.recycled.Hp,
            "sharpened": np.zeros(0) if search.sharpened is None else search.sharpened.point,
            "history": np.array([astuple(iterate) for iterate in search.history], float),
        }  # fmt: skip
        state: dict[str, object] = {
            "key": self.key, "merit": merit, "radius": search.radius, "evaluations": search.evaluations,
            "gradients": search.gradients, "products": search.products, "reason": search.reason,
        }  # fmt: skip
        if limits is not None:
            state |= {name: getattr(limits, name) for name in _OF_LIMITS}
            values |= {f"limit {name}": y for name, y in limits.multipliers.items()}
        values["state"] = np.frombuffer(json.dumps(state).encode(), np.uint8)
        with contextlib.suppress(OSError):
            write_arrays(self.path, values)

    def load(self, limits: LimitTerms | None) -> StoredSearch | None:
        """The stored search; None if there is none of this problem, with a warning if the file is damaged."""
        if self.path is None:
            return None
        try:
            values = read_arrays(self.path)
        except DamagedFileError:
            self.refuse("is damaged")
            return None
        except OSError:
            return None
        try:
            state = json.loads(values["state"].tobytes())
            if state["key"] != self.key:
                return None
            stored = _stored(values, state, limits)
        except (ValueError, KeyError, TypeError, IndexError, OverflowError) as error:
            self.refuse(f"is not usable ({error})")
            return None
        return stored

    def refuse(self, reason: str) -> None:
        """Warn that the file is not used."""
        LOG.warning("The checkpoint %s %s; the search begins anew.", self.path, reason)


def _check_kinds(values: dict[str, np.ndarray], state: dict[str, Any], limits: LimitTerms | None) -> None:
    """Numbers of a file must be of the kinds that a search computes with: kernels take no others.

    Raises:
        ValueError: An array or a number is of another kind.
        KeyError, TypeError: It is missing.
    """
    arrays = {"x": 1, "sharpened": 1, "p": 2, "Hp": 2}
    arrays["history"] = 2 if values["history"].size else values["history"].ndim
    arrays |= {name: values[name].ndim for name in values if name.startswith("limit ")}
    for name, axes in arrays.items():
        if values[name].dtype != np.float64 or values[name].ndim != axes:
            raise ValueError(f"{name} is no array of numbers with {axes} axes")
    breaks = values["breaks"]
    if breaks.dtype.kind != "i" or breaks.ndim != 1 or len(breaks) < 2:
        raise ValueError("its knots are no frames")
    counts = ["evaluations", "gradients", "products", *(["stalled"] if limits is not None else [])]
    sizes = ["radius", *(["rho", "first", "left"] if limits is not None else [])]
    # limits that are kept are exceeded by less than 0
    numbers = ["merit", *(["reached"] if limits is not None else [])]
    for name in counts:
        if type(state[name]) is not int or state[name] < 0:
            raise ValueError(f"{name} is no count")
    for name in sizes:
        if type(state[name]) not in (int, float) or not state[name] >= 0.0:
            raise ValueError(f"{name} is no size")
    for name in numbers:
        if type(state[name]) not in (int, float) or np.isnan(state[name]):
            raise ValueError(f"{name} is no number")
    if type(state["reason"]) is not str or (limits is not None and type(state["on"]) is not bool):
        raise ValueError("its state is of another kind")


def _stored(values: dict[str, np.ndarray], state: dict[str, Any], limits: LimitTerms | None) -> StoredSearch:
    """The search of a file.

    Raises:
        ValueError: An array has another size, or numbers that are not finite.
        KeyError, TypeError, IndexError, OverflowError: Something is missing or of another kind.
    """
    x, p, Hp = values["x"], values["p"], values["Hp"]
    _check_kinds(values, state, limits)
    finite = all(np.all(np.isfinite(values[name])) for name in values if name not in ("state", "history"))
    if not finite or not p.shape == Hp.shape == (len(p), len(x)):
        raise ValueError("its coefficients are not finite or have a wrong size")
    if not np.all(np.einsum("kn,kn->k", p, Hp) > 0.0):  # those of conjugate gradients have
        raise ValueError("its directions have no curvature")
    rows = values["history"].tolist()
    history = tuple(Iterate(row[0], row[1], row[2], int(row[3]), int(row[4])) for row in rows)
    search = Search(
        x, state["radius"], Recycled(p, Hp), Sharpened(values["sharpened"]) if len(values["sharpened"]) else None,
        history, state["evaluations"], state["gradients"], state["products"], state["reason"],
    )  # fmt: skip
    kept: dict[str, Any] = {}
    if limits is not None:
        kept = {name: state[name] for name in _OF_LIMITS}
        kept["multipliers"] = {name: values[f"limit {name}"] for name in limits.bounds}
        if any(kept["multipliers"][name].shape != old.shape for name, old in limits.multipliers.items()):
            raise ValueError("the multipliers of its limits have a wrong size")
    return StoredSearch(search, values["breaks"], float(state["merit"]), kept)
