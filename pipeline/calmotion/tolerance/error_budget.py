"""The error budget of a result, from what was chosen for it and the errors that were estimated on the way."""

from dataclasses import replace

from calmotion.model import Character, Result, Simplification
from calmotion.model.tolerance import (
    CHOICES,
    MESH,
    REDUCTION,
    SEARCH,
    SEARCH_SHARE,
    STEP,
    SUBSPACE,
    BudgetEntry,
    tolerance_of,
)
from calmotion.tolerance import reduction as converged_reduction
from calmotion.tolerance import simulation as simulate_to_tolerance
from calmotion.tolerance import step_choice
from calmotion.tolerance.meshes import mesh_budget


def with_budget(
    result: Result, character: Character, requested: float | None, least_gain: float = SEARCH_SHARE
) -> Result:  # fmt: skip
    """The result with its tolerance and its error budget.

    Args:
        requested: The user's tolerance [m], or None.
        least_gain: As of `RunSettings`.
    """
    tolerance = tolerance_of(character, requested)
    fine = all(mesh_budget.finer_than_known(character, own.body, own.mesh_error, requested) for own in result.modes)
    told = (*result.left_out, *_unknown(result, character, requested))
    return replace(result, left_out=told, tolerance_m=tolerance, budget=_budget(result, tolerance, least_gain, fine))


def _unknown(result: Result, character: Character, requested: float | None) -> tuple[Simplification, ...]:
    """That meshes and reductions are no finer than what is known of the stiffness, where something flexible is."""
    unknown = [mesh_budget.unknown_stiffness(character, table.body, requested) for table in result.modes]
    if not any(unknown):
        return ()
    share, least = 100.0 * max(unknown), 100.0 * mesh_budget.OF_UNCERTAINTY * max(unknown)
    what = f"meshes and reductions that change the stiffness by less than {least:.2g}%"
    why = f"the modulus is known to {share:.3g}%; calm:retarget:uncertainty:modulus sets it, --tolerance asks for more"
    return (Simplification(what, why, result.accuracy.mesh_m if result.accuracy else None, MESH),)


def _budget(result: Result, tolerance: float, least_gain: float, fine: bool) -> tuple[BudgetEntry, ...]:
    accuracy = result.accuracy
    if accuracy is None:
        return ()
    rows = result.left_out

    def entry(source: str, share: float, estimated: float | None, choice: str = "", reason: str = "") -> BudgetEntry:
        told = [row for row in rows if row.source == source]
        choice = choice or "; ".join(row.what for row in told)
        reason = reason or "; ".join(dict.fromkeys(row.why for row in told))
        return BudgetEntry(source, share * tolerance, estimated, choice or "nothing is left out", reason)

    reduction = accuracy.left_out_m - accuracy.subspace_m - accuracy.choices_m
    besides = simulate_to_tolerance.besides_step(accuracy)
    for_step = step_choice.step_allowance(tolerance, besides) / tolerance
    entries = [
        entry(STEP, for_step, accuracy.step_m),
        entry(REDUCTION, converged_reduction.SHARE, max(reduction, 0.0)),
        entry(SUBSPACE, simulate_to_tolerance.HELD, accuracy.subspace_m),
        entry(CHOICES, simulate_to_tolerance.HELD, accuracy.choices_m),
    ]
    if result.modes:
        rest = tolerance - sum(other.estimated_m or 0.0 for other in entries)
        left = max(rest, mesh_budget.SHARE * tolerance)  # other entries may be beyond their shares
        entries.append(replace(_mesh_entry(result, accuracy.mesh_m, left), counted=not fine))
    if result.after is not None:
        ended = result.search.stopped == "converged"
        why = "a smaller gain is not pursued" if ended else f"the search ended before: {result.search.stopped}"
        entries.append(entry(SEARCH, least_gain, least_gain * tolerance if ended else None, result.search.stopped, why))
    return tuple(sorted(entries, key=lambda e: -(e.estimated_m or 0.0)))


def _mesh_entry(result: Result, estimated: float | None, left: float) -> BudgetEntry:
    """The finite-element meshes may cost what all else leaves of the tolerance, at least their share of it [m]."""
    elements, count = sum(table.elements for table in result.modes), len(result.modes)
    choice = f"{elements} elements in {count} flexible {'body' if count == 1 else 'bodies'}"
    reason = "by the element sizes of the bodies" if estimated is not None else "the error of a given mesh is not known"
    return BudgetEntry(MESH, left, estimated, choice, reason)
