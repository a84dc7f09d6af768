"""The best point of a search on disk: written atomically, verified, and read only for the same problem and code.

A search that resumes begins at the point. What the file says of it is simulated again; nothing else is believed.
"""

import contextlib
import hashlib
import logging
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.retargeting.problem.offset_basis import OffsetBasis
from calmotion.retargeting.problem.problem import RetargetProblem
from calmotion.support.caching.bundled_kernels import source_digest
from calmotion.support.caching.verified_files import DamagedFileError, read_arrays, write_arrays

# A point belongs to the code that computed it.
_ROOMS = ("linear_algebra", "multibody", "retargeting", "simulation", "support")
OBJECTIVE_ROUNDING = 1e-4  # largest relative difference of the objective when a stored point is simulated again
LOG = logging.getLogger("calmotion")


def checkpoint_path(layer: str) -> Path:
    """The file beside a layer that contains the best point of its optimisation."""
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
        arrays += problem.limits.shifts.values()
    for array in map(np.asarray, arrays):
        digest.update(str((array.shape, array.dtype)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


@dataclass(frozen=True, eq=False)
class StoredPoint:
    """The best point of a search that was interrupted.

    Attributes:
        x: Its coefficients, shape [n].
        breaks: Frames of its knots, shape [k].
        objective: Its objective, without the terms of limits.
        iterations: That led to it.
    """

    x: Array
    breaks: IntArray
    objective: float
    iterations: int

    def fits(self, basis: OffsetBasis) -> bool:
        """Whether its knots are knots of the shot of a basis."""
        ends = basis.breaks[[0, -1]]
        return bool(np.all(np.diff(self.breaks) > 0) and np.array_equal(self.breaks[[0, -1]], ends))

    def matches(self, objective: float) -> bool:
        """Whether the point has the recorded objective when it is simulated again."""
        rounding = OBJECTIVE_ROUNDING * max(abs(self.objective), abs(objective))
        return bool(np.isfinite(objective) and abs(objective - self.objective) <= rounding)


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """The best point of the search of one problem in one verified file; without a path nothing is written.

    Attributes:
        path: The file.
        key: Of the problem.
    """

    path: Path | None
    key: str

    def save(self, point: StoredPoint) -> None:
        """Write the point. If the folder cannot be written, nothing happens and the run continues."""
        if self.path is None:
            return
        key = np.frombuffer(self.key.encode(), np.uint8)
        with contextlib.suppress(OSError):
            write_arrays(self.path, {"key": key, **asdict(point)})

    def load(self) -> StoredPoint | None:
        """The stored point; None if there is none of this problem, with a warning if the file is damaged."""
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
            return _point(values) if values["key"].tobytes() == self.key.encode() else None
        except (ValueError, KeyError) as error:
            self.refuse(f"is not usable ({error})")
            return None

    def refuse(self, reason: str) -> None:
        """Warn that the file is not used."""
        LOG.warning("The checkpoint %s %s; the search begins anew.", self.path, reason)


def _point(values: dict[str, np.ndarray]) -> StoredPoint:
    """The point of a file; kernels take no numbers of another kind.

    Raises:
        ValueError: An array is of another kind.
        KeyError: It is missing.
    """
    count, real = np.signedinteger, np.float64
    for name, kind, axes in (("x", real, 1), ("breaks", count, 1), ("objective", real, 0), ("iterations", count, 0)):
        array = values[name]
        if not np.issubdtype(array.dtype, kind) or array.ndim != axes or not np.all(np.isfinite(array)):
            raise ValueError(f"{name} is of another kind")
    if len(values["breaks"]) < 2 or values["iterations"] < 0:
        raise ValueError("it has no knots, or no iterations")
    return StoredPoint(values["x"], values["breaks"], float(values["objective"]), int(values["iterations"]))
