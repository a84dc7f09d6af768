"""The text of a recording: errors before and after, sizes, and simplifications."""

from collections.abc import Callable

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Character, Result, Simulation, SystemModes, verdict_on
from calmotion.support import distinct_names

SHOWN_MODES = 6


def describe(character: Character, result: Result, system: SystemModes | None = None) -> str:
    """The summary as Markdown; positions in mm, rotations in degrees.

    Args:
        system: Natural modes of the whole character.
    """
    parts = [f"# {character.path}", errors_table(character, result), sizes(character, result, system)]
    parts += [budget(result), left_out(result)]
    if character.notes:
        parts.append("## Notes on the shot\n" + "\n".join(f"- {note}" for note in character.notes))
    return "\n\n".join(parts) + "\n"


def errors_table(character: Character, result: Result) -> str:
    """One row for each target."""
    names = distinct_names([target.path for target in character.targets])
    runs = {" before": result.before, " after": result.after} if result.after is not None else {"": result.before}
    heads = [f"{measure}{when}" for measure in ("largest", "rms") for when in runs]
    rows = [f"| target | {' | '.join(heads)} |", f"|---|{'---:|' * len(heads)}"]
    largest = np.max(result.before.position_errors[result.before.motion.judged], axis=0, initial=0.0)
    weights = [target.position_weight for target in character.targets]
    for k in sorted(range(len(weights)), key=lambda k: (-weights[k], -largest[k])):  # the main target first
        target, cells = character.targets[k], []
        for measure in (np.max, lambda e: np.sqrt(np.mean(e**2))):
            for simulation in runs.values():
                cells.append(error_cell(simulation, k, target.rotation_weight > 0.0, measure))
        rows.append(f"| `{names[target.path]}` | " + " | ".join(cells) + " |")
    return "## Errors at the targets\n" + "\n".join(rows)


def error_cell(simulation: Simulation, target: int, rotation: bool, measure: Callable[[Array], float]) -> str:
    """Position error, and rotation error where it counts."""
    rows = simulation.motion.judged
    text = f"{1e3 * measure(simulation.position_errors[rows, target]):.2f} mm"
    if rotation:
        text += f", {np.degrees(measure(simulation.rotation_errors[rows, target])):.2f}°"
    return text


def sizes(character: Character, result: Result, system: SystemModes | None) -> str:
    """Size of the model and cost of the run."""
    lines = [
        f"- {len(character.bodies)} bodies, {len(character.motors)} motors, {result.dof} position coordinates",
        f"- time step {1e3 * result.step_s:.3g} ms, pre-roll {result.pre_roll_s:g} s",
    ]
    if system is not None:
        frequencies = ", ".join(f"{f:.1f}" for f in system.frequencies[:SHOWN_MODES])
        pose = f"pose at {system.time_s:.2f} s (largest error)" if system.time_s > 0.0 else "first pose"
        lines.append(f"- modes of the whole character in its {pose}: {frequencies} Hz")
    names = distinct_names([body.path for body in character.bodies])
    for table in result.modes:
        shown = ", ".join(f"{f:.1f}" for f in table.frequencies[:6])
        more = ", ..." if len(table.frequencies) > 6 else ""
        size = f"{table.nodes} nodes, {table.elements} elements, {table.mass:.3g} kg"
        lines.append(f"- `{names[character.bodies[table.body].path]}`: {size}; clamped at its parent: {shown}{more} Hz")
    if result.after is not None:
        lines.append(
            f"- {result.search.iterations} iterations in {result.wall_s:.2f} s, {result.search.parameters} parameters"
        )
    return "## Model\n" + "\n".join(lines)


def budget(result: Result) -> str:
    """The error budget, and whether the simulation keeps the tolerance."""
    verdict = verdict_on(result.budget, result.tolerance_m)
    tolerance = f"tolerance {1e3 * result.tolerance_m:.3g} mm"
    if verdict.error_m is None:
        return f"## Accuracy\n{tolerance}; the error of the simulation was not estimated."
    kept = "kept" if verdict.kept else f"not kept, mostly because of the {verdict.short}"
    rows = [f"{tolerance}, {kept}: estimated error {1e3 * verdict.error_m:.3g} mm", ""]
    rows += ["| source | allowed | estimated | choice |", "|---|---:|---:|---|"]
    for entry in result.budget:
        cost = "unknown" if entry.estimated_m is None else f"{1e3 * entry.estimated_m:.3g} mm"
        rows.append(f"| {entry.source} | {1e3 * entry.allowed_m:.3g} mm | {cost} | {entry.choice} |")
    return "## Accuracy\n" + "\n".join(rows)


def left_out(result: Result) -> str:
    """The simplifications of the run, with their estimated errors."""
    if not result.left_out:
        return "## Simplifications\nNone."
    rows = ["| what | why | estimated error |", "|---|---|---:|"]
    for row in result.left_out:
        cost = "none" if row.estimated_error_m is None else f"{1e3 * row.estimated_error_m:.3g} mm"
        rows.append(f"| {row.what} | {row.why} | {cost} |")
    return "## Simplifications\n" + "\n".join(rows)
