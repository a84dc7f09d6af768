"""What a report tells of the targets: their errors, which counts most, which stand still, and why errors remain."""

from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Character, Result, Simulation, is_exceeded, is_reached
from calmotion.model.result import GOAL_REACHED, LIMITS_EXCEEDED
from calmotion.model.uncertainty import CURVES

_STILL = 1e-3  # of the tolerance: what moves by less stands still


def error_norms(errors: Array) -> tuple[Array, Array]:
    """Largest and root-mean-square error of each target.

    Args:
        errors: Of the time steps that count, [m] or [rad], shape [T, K].

    Returns:
        Two arrays of shape [K], in the unit of `errors`.
    """
    return np.max(errors, axis=0, initial=0.0), np.sqrt(np.mean(errors**2, axis=0))


def target_errors(character: Character, simulation: Simulation, suffix: str) -> list[dict[str, Any]]:
    """The errors of each target, with keys as in the contract: `max_error<suffix>_m` and so on."""
    counted = simulation.motion.judged
    position = error_norms(simulation.position_errors[counted])
    rotation = error_norms(simulation.rotation_errors[counted])
    return [
        {
            "path": target.path,
            "rotation_weight": target.rotation_weight,
            f"max_error{suffix}_m": float(position[0][k]),
            f"rms_error{suffix}_m": float(position[1][k]),
            f"max_rotation_error{suffix}_rad": float(rotation[0][k]),
            f"rms_rotation_error{suffix}_rad": float(rotation[1][k]),
            f"sag{suffix}_m": float(simulation.sag[k]) if len(simulation.sag) else None,
            f"seam{suffix}_m": float(simulation.seam[k]) if len(simulation.seam) else None,
        }
        for k, target in enumerate(character.targets)
    ]


def still_targets(character: Character, result: Result) -> list[str]:
    """Paths of the targets of the input that move neither as animated nor by a shake, as the origin of a link whose
    hinge stands still; those whose rotation counts are left out."""
    motion, least = result.before.motion, _STILL * result.tolerance_m
    places = motion.target_positions[motion.judged]
    moved = np.max(np.abs(places - places[:1]), axis=(0, 2), initial=0.0)
    off = np.max(result.before.position_errors[motion.judged], axis=0, initial=0.0)
    still = np.maximum(moved, off) < least
    return [
        target.path for target, at in zip(character.targets, still, strict=True) if at and not target.rotation_weight
    ]


def main_target(character: Character, result: Result) -> str | None:
    """Path of the target of the largest weight; of several, that which the animation leaves farthest off."""
    errors = np.max(result.before.position_errors[result.before.motion.judged], axis=0, initial=0.0)
    rows = zip(character.targets, errors, strict=True)
    main = max(rows, key=lambda row: (row[0].position_weight, row[1]), default=None)
    return main[0].path if main else None


def goal_report(character: Character, result: Result) -> dict[str, Any]:
    """The goal, and whether each target that counts keeps it after the optimisation; None without a goal."""
    kept = [row["goal_kept"] for row in goal_rows(character, result)]
    counts = [target.position_weight > 0.0 for target in character.targets]
    every = None if result.goal_m is None else all(k for k, counted in zip(kept, counts, strict=True) if counted)
    return {"goal_m": result.goal_m, "goal_kept": every}


def goal_rows(character: Character, result: Result) -> list[dict[str, Any]]:
    """For each target whether it keeps the goal, and where it does not, the limits of motors that hold it."""
    assert result.after is not None
    errors = result.after.position_errors[result.after.motion.judged]
    acting = [
        {"path": character.motors[limit.motor].path, "quantity": limit.quantity}
        for limit in result.limits
        if limit.cost_m is not None or is_exceeded(limit)
    ]
    kept = [None if result.goal_m is None else bool(size <= result.goal_m) for size in errors.max(axis=0, initial=0.0)]
    return [{"goal_kept": one, "limited_by": acting if one is False else []} for one in kept]


def remaining_errors(character: Character, result: Result) -> list[dict[str, Any]]:
    """The targets that the curves found leave farther off than the goal, without one than the tolerance, and why.

    Args:
        character: With the motors that move no target marked as idle.
        result: Of `optimize`.

    Returns:
        Rows with `path`, `max_error_m`, the number of `motors` that could change, the `directions` in which all targets
        are followed, and `causes`: `limits` of motors that cost something, `plugins` whose
        residuals count or whose limits are reached, `search` that did not converge, `sag` where
        half of the error is there at rest and gravity moves the target by as much, `motors` where these are fewer than
        the directions, `weight` where other targets count more, and `reach` where none of these holds, so that these
        motors can do no better.
    """
    if result.after is None:
        return []
    errors, sag, judged = result.after.position_errors, result.after.sag, result.after.motion.judged
    sag = sag if len(sag) else np.zeros(errors.shape[1])
    largest = np.max(errors[judged], axis=0, initial=0.0)
    # a pre-roll begins without the offsets that lift the robot in the shot
    resting = np.minimum(errors[0], errors[judged][0])
    motors = sum(motor.optimize and not motor.idle and motor.follows is None for motor in character.motors)
    weights = [target.position_weight for target in character.targets]
    directions = 3 * sum((t.position_weight > 0.0) + (t.rotation_weight > 0.0) for t in character.targets)
    stopped = result.search.stopped
    common = ["limits"] * (stopped == LIMITS_EXCEEDED or any(limit.cost_m is not None for limit in result.limits))
    common += ["plugins"] * any(term.limit is None or is_reached(term) for term in result.terms)
    common += ["search"] * (stopped not in ("", "converged", GOAL_REACHED, LIMITS_EXCEEDED))
    rows = []
    for k in np.flatnonzero(largest > (result.goal_m or result.tolerance_m)):
        causes = [*common, *["sag"] * bool(min(resting[k], sag[k]) >= 0.5 * largest[k])]
        causes += ["motors"] * (motors < directions) + ["weight"] * (0.0 < weights[k] < max(weights))
        row = {"path": character.targets[k].path, "max_error_m": float(largest[k]), "causes": causes or ["reach"]}
        rows.append(row | {"motors": motors, "directions": directions})
    return rows


def robustness_row(result: Result, target: int) -> dict[str, Any]:
    """The errors of a target on robots that differ from the model, for each set of curves; empty without `--robust`."""
    found = result.robustness
    if found is None:
        return {}
    rows: dict[str, dict[str, float]] = {}
    for name in CURVES:
        rows[name] = {}
        for column, error in enumerate(("error_m", "rotation_error_rad")):
            drawn = found.drawn[name][:, target, column]
            rows[name] |= {
                f"nominal_max_{error}": float(found.nominal[name][target, column]),
                f"median_max_{error}": float(np.median(drawn)),
                f"p95_max_{error}": float(np.quantile(drawn, 0.95, method="higher")),
                f"worst_max_{error}": float(drawn.max()),
            }
    return {"robustness": rows}


def robustness_report(result: Result) -> dict[str, Any]:
    """The robots of a robust search and of its measurement; empty without `--robust`."""
    found = result.robustness
    if found is None:
        return {}
    return {
        "robust": found.kind,
        "scenarios": [{"parameters": dict(s.factors), "weight": s.weight} for s in found.scenarios],
        "draws": len(found.drawn["robust"]),
        "failed_draws": {name: int(np.sum(~np.isfinite(found.drawn[name]).all(axis=(1, 2)))) for name in CURVES},
    }
