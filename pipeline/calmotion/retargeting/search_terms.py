"""Residuals and limits that plugins add to a search."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from scipy.sparse import diags

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Character, TermUse
from calmotion.model.limits.bounds import Bounds, excesses
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.model.run import RunSettings
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.posing import refuse_continuous
from calmotion.retargeting.problem.problem import Evaluation
from calmotion.retargeting.problem.robot import GROUND, of_robot
from calmotion.retargeting.quantities.base import Quantity
from calmotion.retargeting.quantities.functions import FilteredCommands, FunctionOf
from calmotion.retargeting.quantities.terms import AddedLimit, AddedResidual, SearchTerm
from calmotion.simulation.inputs.time_grid import TimeGrid


def refuse_terms(options: RunSettings, character: Character) -> None:
    """Refuse terms that a search cannot have.

    Raises:
        ShotError: One has no name, or that of another one or of a limit of the motors, or the adjoint is continuous.
    """
    for term in options.terms:
        name = getattr(term, "name", "")
        if not name or name in (*kinds_of_limits(), GROUND):
            what = "the name of a limit that every search has" if name else "no name"
            raise ShotError(
                f"a term of the search has {what}", path=character.path, attribute=_place(term), found=name or None,
                remedy="Give its class another `name`, which reports show." if name else "Set `name` in its class.",
            )  # fmt: skip
    names = [term.name for term in options.terms]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ShotError(
            "two terms of the search have one name", path=character.path, found=twice,
            remedy="Rename one of them, or disable one of their plugins.",
        )  # fmt: skip
    if names:
        refuse_continuous(options, character, f"terms of plugins: {', '.join(names)}")


def with_terms(at: Evaluation, character: Character, terms: Sequence[SearchTerm]) -> Evaluation:
    """The curves of the input in a problem with further residuals and limits of each robot.

    Args:
        at: At the curves of the input.

    Raises:
        ShotError: The shot lacks what a term needs, or a quantity, its weight or its bounds are not as they should be.
    """
    if not terms:
        return at
    problem, robots = at.problem, []
    bounds = {} if problem.limits is None else dict(problem.limits.bounds)
    for k, run in enumerate(at.runs):
        residuals, limited = list(run.robot.residuals), dict(run.robot.limited)
        for term in terms:
            with _blamed(term, character):
                made = term.quantity(character, run.robot.model, problem.grid)
                values = _checked(made.values(run.run), problem.grid)
                made.slopes(run.run)  # so that what is wrong with them is told as the term's
                if isinstance(term, AddedLimit) and k and isinstance(made, FilteredCommands):
                    continue  # all robots perform the same curves
                if isinstance(term, AddedLimit):
                    limited[term.name] = made
                    bounds[of_robot(term.name, k)] = _bounds(term, character, values.shape[1])
                elif isinstance(term, AddedResidual):
                    residuals.append(_weighted(term, made, problem.grid, values.shape[1]))
        robots.append(replace(run.robot, residuals=tuple(residuals), limited=limited))
    limits = LimitTerms.of(bounds, problem.grid.judged, problem.grid.h)
    return at.with_robots(replace(problem, robots=tuple(robots), limits=limits))


def term_uses(
    before: Evaluation, after: Evaluation, character: Character, terms: Sequence[SearchTerm]
) -> tuple[TermUse, ...]:
    """What the quantities of terms are on the nominal robot, with the curves of the input and of the result."""
    return tuple(_use(before, after, character, term) for term in terms)


def _use(before: Evaluation, after: Evaluation, character: Character, term: SearchTerm) -> TermUse:
    grid = after.problem.grid
    made = term.quantity(character, after.problem.model, grid)
    old, new = made.values(before.run), made.values(after.run)
    if not isinstance(term, AddedLimit):
        assert isinstance(term, AddedResidual)
        shares = grid.quadrature * np.broadcast_to(np.asarray(term.weight(grid.times), float), len(grid.times))
        shares = shares / max(float(shares.sum()), 1e-300)
        means = [float(np.sqrt(shares @ np.sum(v**2, axis=1))) for v in (old, new)]
        return TermUse(term.name, term.unit, "", *means)
    bounds = {term.name: _bounds(term, character, new.shape[1])}
    first, last = (excesses(bounds, {term.name: values}, grid.judged) for values in (old, new))
    k = int(np.argmax([row.excess for row in last]))
    found, labels = last[k], term.labels(character)
    return TermUse(
        term.name, term.unit, labels[found.motor] if labels else "", first[k].value, found.value, found.limit,
        float(grid.times[found.instant]), found.excess,
    )  # fmt: skip


@contextmanager
def _blamed(term: SearchTerm, character: Character) -> Iterator[None]:
    """Errors of a term are told as its own, not as those of the search."""
    try:
        yield
    except ShotError:
        raise
    except Exception as error:
        raise ShotError(
            f"the term {term.name!r} of a plugin failed", path=character.path, attribute=_place(term),
            found=str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}",
            remedy="Correct the class of the term, or disable its plugin.",
        ) from error  # fmt: skip


def _checked(values: Array, grid: TimeGrid) -> Array:
    """Values of a term's quantity."""
    if values.ndim != 2 or len(values) != len(grid.times):
        raise ValueError(f"values have shape {list(values.shape)} instead of [{len(grid.times)}, R]")
    if not np.all(np.isfinite(values)):
        raise ValueError("values at the input are not finite")
    return values


def _bounds(term: AddedLimit, character: Character, count: int) -> Bounds:
    ends = [np.asarray(end, float) for end in term.bounds(character)]
    if any(end.shape not in ((), (count,)) for end in ends):
        raise ValueError(f"bounds have shapes {[list(e.shape) for e in ends]} instead of [{count}]")
    lower, upper = (np.broadcast_to(end, count).copy() for end in ends)
    if not np.any(np.isfinite([lower, upper])):
        raise ValueError("no bound is finite; add no term where there is no limit")
    if not np.all(lower <= upper):
        raise ValueError(f"the least value {lower.tolist()} is not below the largest {upper.tolist()}")
    return Bounds.between(lower, upper)


def _weighted(term: AddedResidual, made: Quantity, grid: TimeGrid, count: int) -> Quantity:
    weight = np.asarray(term.weight(grid.times), float)
    if weight.shape not in ((), grid.times.shape) or not np.all(weight >= 0.0):
        raise ValueError(f"weights are not {len(grid.times)} numbers of at least 0")
    roots = np.sqrt(weight * grid.quadrature)
    matrix = diags(np.repeat(roots, count), format="csr")
    return FunctionOf(made, lambda values: (roots[:, None] * values, matrix))


def _place(term: SearchTerm) -> str:
    """Where the class of a term is."""
    return f"{type(term).__module__}.{type(term).__qualname__}"
