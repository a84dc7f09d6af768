"""Values as JSON can hold them."""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from calmotion.host import OperatorResult, Run
from calmotion.model import Character, LimitUse, ModelChoices, Provenance, Result, Simplification
from calmotion.model.character import motors_give
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.model.limits.use import TermUse, is_exceeded
from calmotion.model.motor import measure_of
from calmotion.model.outputs import CsvFile, Figures, Recording, Rig, Verification, Video, WrittenLayer
from calmotion.model.result import Retimed
from calmotion.model.run import Source
from calmotion.model.tolerance import Verdict, verdict_on
from calmotion.support.memory import peak_memory
from calmotion.version import __version__
from calmotion.workflow.reactions import contact_rows, reaction_rows
from calmotion.workflow.targets import (
    goal_report,
    goal_rows,
    main_target,
    remaining_errors,
    robustness_report,
    robustness_row,
    still_targets,
    target_errors,
)


def plain(value: Any) -> Any:
    """`value` as JSON can hold it: NumPy as Python, and null for what is not a finite number."""
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def left_out_row(row: Simplification) -> dict[str, Any]:
    """One row of `left_out`."""
    return {"what": row.what, "why": row.why, "estimated_error_m": row.estimated_error_m, "skipped": row.skipped}


def limit_row(character: Character, limit: LimitUse) -> dict[str, Any]:
    """One row of `limits`."""
    motor, kind = character.motors[limit.motor], kinds_of_limits()[limit.quantity]
    measure = measure_of(motor)
    return {
        "path": motor.path,
        "quantity": limit.quantity,
        "unit": kind.unit(measure, measure.si),
        "limit": limit.limit,
        "before": limit.before,
        "after": limit.after,
        "time_s": limit.time_s,
        "shown": [kind.shown(measure, v) for v in (limit.limit, limit.before, limit.after)],
        "exceeded": is_exceeded(limit),
        "cost_m": limit.cost_m,
    }


def term_row(term: TermUse) -> dict[str, Any]:
    """One row of `terms`, of which residuals have no limit."""
    limits = {} if term.limit is None else {"time_s": term.time_s, "exceeded": is_exceeded(term)}
    return {
        "name": term.name,
        "unit": term.unit,
        "label": term.label,
        "before": term.before,
        "after": term.after,
        "limit": term.limit,
        **limits,
    }


def effort_rows(character: Character, result: Result) -> list[dict[str, Any]]:
    """The largest effort of each motor during the shot, and its estimated error by the time step."""
    motion = (result.after or result.before).motion
    largest = np.max(np.abs(motion.motor_efforts[motion.judged]), axis=0, initial=0.0)
    errors = None if result.accuracy is None else result.accuracy.efforts
    return [
        {
            "path": motor.path,
            "unit": measure_of(motor).effort_unit,
            "largest": float(largest[k]),
            "estimated_error": None if errors is None else float(errors[k]),
        }
        for k, motor in enumerate(character.motors)
    ]


def operator_row(result: OperatorResult) -> dict[str, Any]:
    """The outcome of an operator."""
    return {
        "operator": result.idname,
        "plugin": result.plugin,
        "outcome": str(result.outcome),
        "reason": result.reason,
        "duration_s": result.duration,
        "processor_s": result.processor_s,
        "peak_memory_gb": result.peak_memory_gb if math.isfinite(result.peak_memory_gb) else None,
        "reports": [{"level": record.level, "text": record.text} for record in result.records],
    }


def run_report(run: Run, character: Character, result: Result, command: str, total_wall_s: float) -> dict[str, Any]:
    """Everything about a finished `simulate` or `optimize`."""
    final, choices, provenance = result.after or result.before, run.get(ModelChoices), run.get(Provenance)
    report: dict[str, Any] = {"command": command, "version": __version__}
    report |= _optimized(character, result) if result.after else _simulated(character, result)
    report |= {
        "wall_s": result.wall_s,
        "processor_s": result.search.processor_s,
        "total_wall_s": total_wall_s,
        "peak_memory_gb": peak if math.isfinite(peak := peak_memory()) else None,
        "steps": len(final.motion.times),
        "step_s": result.step_s,
        "pre_roll_s": result.pre_roll_s,
        "dof": result.dof,
        "modes": (modes := sum(elastic.shape[1] for elastic in final.motion.elastic)),
        "can_shake": modes > 0 or motors_give(character),
        "parameters": result.search.parameters,
        "newton_iterations": final.newton_iterations,
        "limits": [limit_row(character, limit) for limit in result.limits],
        "terms": [term_row(term) for term in result.terms],
        "max_joint_gap_m": final.max_joint_gap,
        "refined_steps": final.refined_steps,
        "loop_growth": final.floquet_multiplier,
        "dead_centres_s": final.dead_centres.tolist(),
        **_accuracy(run, result),
        "error_shares": _error_shares(character, result),
        "lost_motion": lost_motion(character, result),
        "friction_band": _friction_band(character, result),
        **_with_calibration(character, report[f"max_error{'_after' if result.after else ''}_m"]),
        "main_target": main_target(character, result),
        "still_targets": still_targets(character, result),
        "remaining_errors": remaining_errors(choices.character if choices else character, result),
        "efforts": effort_rows(character, result),
        "reactions": reaction_rows(character, final.motion),
        "contacts": contact_rows(character if result.retimed is None else result.retimed.character, final.motion),
        "retime": _retime(character, result.retimed),
        "frequencies_hz": {character.bodies[table.body].path: table.frequencies for table in result.modes},
    }
    source = run.get(Source)
    report["shot"] = source.path if source is not None else None
    if source is not None and source.shaper:
        report |= _shaped(source.shaper, result)
    layer, recording, table, figures = run.get(WrittenLayer), run.get(Recording), run.get(CsvFile), run.get(Figures)
    report |= {
        "layer": layer.layer if layer else None,
        "root_layer": layer.root if layer else None,
        "rrd": recording.path if recording else None,
        "csv": table.path if table else None,
        "figures": figures.paths if figures else [],
        "video": video.path if (video := run.get(Video)) else None,
        "html": None,  # a page has words of this report, and is written after it
        "left_out": [left_out_row(row) for row in (*run.left_out(), *result.left_out)],
        "notes": list(character.notes),
        "written_names": dict(provenance.names) if provenance else {},
        "operators": [operator_row(row) for row in run.results],
    }
    return report


def _retime(character: Character, retimed: Retimed | None) -> dict[str, Any] | None:
    """The tempo that was found; None where the tempo could not change."""
    if retimed is None:
        return None
    report, tempo = retimed.report, retimed.animation.tempo
    return {
        "added_s": 0.0 if tempo is None else tempo.added,
        "uniform_added_s": report.uniform_added,
        "lower_bound_s": report.lower_bound,
        "map": [] if tempo is None else np.stack([tempo.animation, tempo.performance], axis=1).tolist(),
        "stretches": [
            {
                "from_s": part.start,
                "to_s": part.end,
                "factor": part.factor,
                "because": [{"path": character.motors[k].path, "quantity": name} for k, name in part.because],
            }
            for part in report.stretches
        ],
        "lacking_stretch": report.lacking or None,
        "pins": [{"time_s": time, "shift_s": shift} for time, shift in report.pins],
    }


def _error_shares(character: Character, result: Result) -> list[dict[str, Any]]:
    """The largest error of each target in the input where only motors, or only links, are left to cause it."""
    shares = result.error_shares
    if shares is None:
        return []
    return [
        {"path": target.path, "motors_m": float(motors), "links_m": float(links)}
        for target, motors, links in zip(character.targets, shares.motors_m, shares.links_m, strict=True)
    ]


def _friction_band(character: Character, result: Result) -> list[dict[str, Any]]:
    """By how much the friction of motors may hold each target off."""
    found = result.friction_band_m
    if found is None:
        return []
    return [{"path": t.path, "max_error_m": float(size)} for t, size in zip(character.targets, found, strict=True)]


def _with_calibration(character: Character, error: float) -> dict[str, float | None]:
    """What the calibrated robot was off its recordings, and the largest error with it: as errors that have nothing to
    do with each other, the root of the sum of squares; None where no calibration tells."""
    off = character.retarget.uncertainty.calibrated.largest_error_m
    return {"calibration_error_m": off or None, "max_error_with_calibration_m": math.hypot(error, off) if off else None}


def lost_motion(character: Character, result: Result) -> dict[str, Any] | None:
    """What the play of gears would do at the targets, and how often each gear changes its side; None without play."""
    if not result.lost_motion:
        return None
    found = dict(zip(("_before", "_after") if result.after else ("",), result.lost_motion, strict=True))
    last = result.lost_motion[-1]
    motors = [
        {"path": (motor := character.motors[k]).path, f"backlash_{measure_of(motor).si}": motor.backlash}
        | {f"reversals{suffix}": len(lost.reversals[row]) for suffix, lost in found.items()}
        | {"reversal_times_s": last.reversals[row].tolist(), "followed": k not in last.unknown}
        for row, k in enumerate(last.motors)
    ]
    targets = [
        {"path": target.path}
        | {f"max_error{suffix}_m": float(lost.largest_m[k]) for suffix, lost in found.items()}
        | {"time_s": float(last.time_s[k])}
        for k, target in enumerate(character.targets)
    ]
    return {"motors": motors, "targets": targets}


def _shaped(shaper: str, result: Result) -> dict[str, Any]:
    """The error that is left when the delay of an input shaper is not counted."""
    from calmotion.simulation.inputs.shapers import best_delay

    motion = result.before.motion
    intended = result.reference.target_positions
    delay, off = best_delay(motion.target_positions, intended, motion.judged, result.step_s)
    return {"shaper": shaper, "shaper_delay_s": delay, "delayed_max_error_m": float(off.max(initial=0.0))}


def verdict_of(run: Run, result: Result) -> Verdict:
    """Whether a result keeps its tolerance, by the measured error where it was verified."""
    verified = run.get(Verification)
    return verdict_on(result.budget, result.tolerance_m, verified.bound_m if verified else None)


def _accuracy(run: Run, result: Result) -> dict[str, Any]:
    """How far the targets are from where a finer simulation has them: estimated, and measured with `--verify`."""
    accuracy, verified, verdict = result.accuracy, run.get(Verification), verdict_of(run, result)
    return {
        "tolerance_m": result.tolerance_m,
        "tolerance_kept": verdict.kept,
        "tolerance_missed_by": verdict.short or None,
        "simulation_error_m": verdict.error_m,
        "error_budget": [asdict(entry) for entry in result.budget],
        "estimated_error_m": accuracy.estimated_m if accuracy else None,
        "estimated_step_error_m": accuracy.step_m if accuracy else None,
        "estimated_mesh_error_m": accuracy.mesh_m if accuracy else None,
        "verified_error_m": verified.error_m if verified else None,
        "verified_mesh_error_m": verified.mesh_m if verified else None,
        "verified_step_s": verified.step_s if verified else None,
        "verified_modes": verified.modes if verified else None,
    }


def _simulated(character: Character, result: Result) -> dict[str, Any]:
    targets = target_errors(character, result.before, "")
    return {"targets": targets, **_overall(targets, ""), "objective": result.objective_before}


def _optimized(character: Character, result: Result) -> dict[str, Any]:
    assert result.after is not None and result.objective_after is not None
    before = target_errors(character, result.before, "_before")
    after = target_errors(character, result.after, "_after")
    return {
        "targets": [
            one | other | goal | robustness_row(result, k)
            for k, (one, other, goal) in enumerate(zip(before, after, goal_rows(character, result), strict=True))
        ],
        **goal_report(character, result),
        **robustness_report(result),
        **_overall(before, "_before"),
        **_overall(after, "_after"),
        "improved": result.improved,
        "objective_before": result.objective_before,
        "objective_after": result.objective_after,
        "forward_simulations": result.search.forward_simulations,
        "stopped": result.search.stopped,
        "interrupted": result.interrupted,
        "resumed_iterations": result.search.resumed_iterations,
        "expected_further_gain_m": result.search.expected_gain_m,
        "gradients": result.search.gradients,
        "linearized_sweeps": result.search.linearized_sweeps,
        "iterations": result.search.iterations,
        # The last forward simulation: everything is compiled and warm by then.
        "simulate_wall_s": result.after.wall_s,
        "motors": [
            {
                "path": character.motors[curve.motor].path,
                "changed": curve.changed,
                f"max_offset_{measure_of(character.motors[curve.motor]).si}": curve.max_offset,
            }
            for curve in result.curves
        ],
    }


def _overall(targets: list[dict[str, Any]], suffix: str) -> dict[str, float]:
    """The worst target, and the root mean square over all of them."""
    worst = max((row[f"max_error{suffix}_m"] for row in targets), default=0.0)
    square = sum(row[f"rms_error{suffix}_m"] ** 2 for row in targets) / max(len(targets), 1)
    return {f"max_error{suffix}_m": worst, f"rms_error{suffix}_m": square**0.5}


def rig_report(made: Rig) -> dict[str, Any]:
    """The object of `rig --json`."""
    return {
        "command": "rig",
        "version": __version__,
        "layer": made.layer,
        "robot": made.robot,
        "bodies": made.bodies,
        "mass_kg": made.mass,
        "motors": sum(len(joint.motors) for joint in made.joints),
        "max_angle_error_rad": max((joint.off for joint in made.joints), default=0.0),
        "max_error_m": made.off,
        "joints": [
            {"joint": j.joint, "body": j.body, "motors": j.motors, "angle_error_rad": j.off} for j in made.joints
        ],
        "targets": made.targets,
        "flexible": made.flexible,
        "notes": made.notes,
    }
