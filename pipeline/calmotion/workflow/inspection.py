"""The content of a shot: the object of `inspect --json`, from the values of a run."""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from calmotion.host import HostError, Run, Settings
from calmotion.model import (
    Animation,
    Body,
    Character,
    ExceededLimits,
    FEMesh,
    FEMeshes,
    Findings,
    ModelChoices,
    ModeTable,
    Motor,
    Provenance,
    Simplification,
    Track,
)
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.model.motor import SERVO, measure_of
from calmotion.model.outputs import WARNING, Finding, ModeShapes, MotorEffects, PlannedStep, SystemModes, TempoFigure
from calmotion.model.run import RunSettings
from calmotion.tolerance.reduced_bodies import ReducedBodies
from calmotion.version import __version__
from calmotion.workflow.problems import Problem
from calmotion.workflow.report import left_out_row, limit_row, operator_row
from calmotion.workflow.run import Outcome

SHOWN_MODES = 10
_SAME_MASS = 0.1  # relative difference to that of rough sections that is not told
_CONTENTS: tuple[type, ...] = (Character, Animation, Provenance)


def wanted_of(strict: bool, modes: bool, figures: bool = False) -> tuple[tuple[type, ...], tuple[type, ...]]:
    """What an inspection needs, and what it makes where it can.

    Args:
        strict: Whether the shot is only checked, without costly work.
        modes: Whether mode shapes are requested.
        figures: Whether figures are.
    """
    wanted: tuple[type, ...] = (Findings,) if strict else _CONTENTS
    costly = (ModelChoices, ReducedBodies, SystemModes, PlannedStep, MotorEffects)
    optional = (ExceededLimits, *(_CONTENTS if strict else costly))
    return (*wanted, *((ModeShapes,) if modes else ())), (*optional, *((TempoFigure,) if figures else ()))


class Inspection:
    """An inspected shot.

    Attributes:
        problems: What went wrong.
        interrupted: Whether the user interrupted it.
    """

    def __init__(self, outcome: Outcome):
        self._run, self._path, self._settings = outcome.run, outcome.shot.path, outcome.settings
        self.interrupted = outcome.interrupted
        self.problems: tuple[Problem, ...] = outcome.problems
        if self.findings is not None:
            # what the reader refuses is among the findings, with the rest
            self.problems = tuple(problem for problem in self.problems if isinstance(problem.error, HostError))

    @property
    def findings(self) -> Findings | None:
        """What a strict inspection found; None without `strict`."""
        found, exceeded = self._run.get(Findings), self._run.get(ExceededLimits)
        if found is None or exceeded is None:
            return found
        return Findings((*found.items, *_beyond(self._run.data[Character], exceeded)))

    def report(self) -> dict[str, Any]:
        """The object that `--json` prints; empty where the shot could not be read."""
        from calmotion.workflow.report import plain

        report = inspect_report(self._run, self._settings) if all(self._run.get(kind) for kind in _CONTENTS) else {}
        if self.findings is not None:
            rows = [dataclasses.asdict(finding) for finding in self.findings.items]
            report |= {"shot": self._path, "findings": rows}
        made: dict[str, Any] = plain(report)
        return made


def _beyond(character: Character, exceeded: ExceededLimits) -> Iterator[Finding]:
    """The limits that the animation exceeds, but those of positions, which the rules for the stage find."""
    for use in exceeded.uses:
        row, kind = limit_row(character, use), kinds_of_limits()[use.quantity]
        if use.quantity == "position":
            continue
        limit, _, value = row["shown"]
        yield Finding(
            WARNING, "AnimationKeepsLimits", row["path"], kind.raised_by,
            f"the animation exceeds the {use.quantity} of its motor", f"{value} at {use.time_s:.3f} s, limit {limit}",
            "Slow the animation down there, or raise the limit if the motor can do more",
        )  # fmt: skip


def _tempo_report(character: Character, exceeded: ExceededLimits | None) -> dict[str, Any] | None:
    """How much slower the animation has to be; None where it need not, or that is not known."""
    tempo = None if exceeded is None else exceeded.tempo
    if tempo is None:
        return None
    possible, weak = bool(np.isfinite(tempo.uniform)), tempo.too_weak
    held = None if weak is None else character.motors[weak.motor]
    return {
        "possible": possible,
        "uniform_stretch": tempo.uniform if possible else None,
        "uniform_added_s": tempo.uniform_added_s if possible else None,
        "least_added_s": tempo.least_added_s if possible else None,
        "too_weak": None
        if weak is None or held is None
        else {
            "path": held.path,
            "time_s": weak.time_s,
            "needed": weak.needed,
            "limit": held.max_torque,
            "unit": measure_of(held).effort_unit,
        },
    }


def inspect_report(run: Run, settings: Settings | None = None) -> dict[str, Any]:
    """The object of `inspect --json`; SI units and radians, as the names of the keys say.

    Args:
        settings: Settings of operators that were given to it.
    """
    character, animation, provenance = run.data[Character], run.data[Animation], run.data[Provenance]
    reduced, modes, choices = run.get(ReducedBodies), run.get(SystemModes), run.get(ModelChoices)
    exceeded = run.get(ExceededLimits)
    tables = {table.body: table for table in reduced.modes} if reduced else {}
    names = [body.path for body in character.bodies]
    meshes = {mesh.body: mesh for mesh in made.meshes} if (made := run.get(FEMeshes)) else {}
    flexible = [body.simulated_flexible for body in (choices.character if choices else character).bodies]
    return {
        "command": "inspect",
        "version": __version__,
        "shot": provenance.shot,
        "layers": [{"path": layer.path, "sha256": layer.sha256} for layer in provenance.layers],
        "earlier_layers": list(provenance.earlier_layers),
        "units": {
            "meters_per_unit": provenance.meters_per_unit,
            "kilograms_per_unit": provenance.kilograms_per_unit,
            "up_axis": provenance.up_axis,
            "time_codes_per_second": provenance.time_codes_per_second,
            "frames_per_second": provenance.frames_per_second,
        },
        "frames": len(animation.frame_times),
        "duration_s": float(animation.frame_times[-1]),
        "character": character.path,
        "gravity_m_s2": character.gravity,
        "bodies": [
            _body(body, tables.get(index), meshes.get(index), flexible[index])
            for index, body in enumerate(character.bodies)
            if not body.between
        ],
        "joints": [
            {
                "path": joint.path,
                "kind": joint.kind if joint.contact is None else "contact",
                "body0": names[joint.body0] if joint.body0 >= 0 else "",
                "body1": names[joint.body1] if joint.body1 >= 0 else "",
                "lower_rad": joint.lower,
                "upper_rad": joint.upper,
            }
            for joint in character.joints
        ],
        "motors": [
            _motor(motor, track, character) for motor, track in zip(character.motors, animation.tracks, strict=True)
        ],
        "targets": [
            {
                "path": target.path,
                "body": names[target.body],
                "position_weight": target.position_weight,
                "rotation_weight": target.rotation_weight,
            }
            for target in character.targets
        ],
        "limits": [limit_row(character, use) for use in exceeded.uses] if exceeded else [],
        "tempo": _tempo_report(character, exceeded),
        "effects_of_gains": _effects(character, run.get(MotorEffects)),
        "expected": _expected(character, animation),
        "system_frequencies_hz": modes.frequencies[:SHOWN_MODES].tolist() if modes else [],
        "system_damping_ratios": modes.damping[:SHOWN_MODES].tolist() if modes else [],
        "figures": [drawn.path] if (drawn := run.get(TempoFigure)) else [],
        "mode_shapes": list(shapes.paths) if (shapes := run.get(ModeShapes)) else [],
        "notes": list(character.notes),
        "written_names": dict(provenance.names),
        "needs": [dataclasses.asdict(row) for row in choices.rows] if choices else [],
        "left_out": [left_out_row(row) for row in (*run.left_out(), *_without(choices, reduced, run.get(PlannedStep)))],
        "operators": [operator_row(row) for row in run.results],
    }


def _expected(character: Character, animation: Animation) -> dict[str, float]:
    """What `optimize` is expected to take: memory and time, of the order of the real ones."""
    from calmotion.tolerance.cost import expected_cost

    cost = expected_cost(character, animation, RunSettings(), True)
    return {
        "duration_s": float(animation.frame_times[-1]),
        "steps": cost.steps,
        "memory_gb": cost.memory / 1e9,
        "hours": cost.hours,
    }


def _without(
    choices: ModelChoices | None, reduced: ReducedBodies | None, step: PlannedStep | None
) -> Sequence[Simplification]:
    """The simplifications of the shot and of its flexible bodies."""
    rows = list(choices.left_out) if choices else []
    rows += [row for body in reduced.bodies for row in body.left_out] if reduced else []
    return [*rows, step.row] if step else rows


def _body(body: Body, table: ModeTable | None, mesh: FEMesh | None, flexible: bool) -> dict[str, Any]:
    report: dict[str, Any] = {
        "path": body.path,
        "kind": "flexible" if body.flexible else "rigid",
        "simulated": "flexible" if flexible else "rigid",
        # The mesh's mass is the one that is simulated, so it beats the one of the shot.
        "mass_kg": table.mass if table else body.mass.mass if body.mass else None,
    }
    if body.flexible:
        material = body.flexible.material
        report |= {
            "material": material.path,
            "youngs_modulus_pa": material.youngs_modulus,
            "poissons_ratio": material.poissons_ratio,
            "density_kg_m3": material.density,
        }
        if material.parts:
            report["parts"] = [
                {
                    "path": part.path,
                    "material": part.material,
                    "youngs_modulus_pa": part.modulus * material.youngs_modulus,
                    "density_kg_m3": part.density * material.density,
                    "damping_ratio": part.damping,
                }
                for part in material.parts
            ]
    if table:
        report |= {
            "frequencies_hz": table.frequencies,
            "frequencies_from": table.source,
            "nodes": table.nodes,
            "elements": table.elements,
        }
    if table and table.volume is not None:
        from calmotion.mesh.mass import density_note

        report |= {
            "solid": "sections",
            "volume_m3": table.volume,
            "volume_error": None,
            "frequency_error": None,
            "solid_notes": list(density_note(body, table.volume, _SAME_MASS)),
        }
    if mesh:
        quality = mesh.quality
        report |= {
            "solid": quality.source,
            "volume_m3": quality.volume,
            "volume_error": quality.volume_error,
            "frequency_error": quality.frequency_error,
            "solid_notes": list(quality.repairs),
        }
    return report


def _motor(motor: Motor, track: Track, character: Character) -> dict[str, Any]:
    joint = character.joints[motor.joint]
    unit, newtons = measure_of(motor).si, "n" if motor.linear else "n_m"
    speeds = np.abs(np.diff(track.values) / np.diff(track.times))
    return {
        "path": motor.path,
        "attribute": motor.attribute,
        "optimize": motor.optimize,
        "samples": len(track.times),
        f"min_{unit}": float(track.values.min()),
        f"max_{unit}": float(track.values.max()),
        f"lower_{unit}": joint.lower,
        f"upper_{unit}": joint.upper,
        f"peak_velocity_{unit}_s": float(speeds.max(initial=0.0)),
        f"max_velocity_{unit}_s": motor.max_velocity,
        f"max_acceleration_{unit}_s2": motor.max_acceleration,
        f"max_jerk_{unit}_s3": motor.max_jerk,
        "max_force_n" if motor.linear else "max_torque_n_m": motor.max_torque,
        "model": motor.model,
        f"position_gain_{newtons}_{unit}": motor.position_gain,
        f"velocity_gain_{newtons}_s_{unit}": motor.velocity_gain,
        "gains_from": motor.gains_from,
        "damping_on": motor.damping_on,
        "type": motor.kind,
        "delay_s": motor.delay,
        f"backlash_{unit}": motor.backlash,
        "coupled_to": None if motor.turns_with is None else character.motors[motor.turns_with.other].path,
        "coupling": 0.0 if motor.turns_with is None else motor.turns_with.ratio,
        "rotor": _rotor(motor, newtons, unit) if motor.kind or motor.model_of_gains == SERVO else None,
    }


def _rotor(motor: Motor, newtons: str, unit: str) -> dict[str, float | str]:
    """The rotor of a servo; infinite where there is no limit."""
    own = motor.rotor
    return {
        "armature_kg" if motor.linear else "armature_kg_m2": own.armature,
        f"gear_stiffness_{newtons}_{unit}": own.gear_stiffness,
        f"gear_damping_{newtons}_s_{unit}": own.gear_damping,
        f"viscous_friction_{newtons}_s_{unit}": own.viscous_friction,
        f"friction_{newtons}": own.friction,
        f"friction_speed_{unit}_s": own.friction_speed,
        f"no_load_speed_{unit}_s": own.no_load_speed,
        "torque_speed_knee": own.knee,
        "friction_model": own.law.name,
        f"back_emf_{newtons}_s_{unit}": own.back_emf,
    }


def _effects(character: Character, effects: MotorEffects | None) -> list[dict[str, Any]]:
    """What the gains of the motors would do to the animation at each target; empty where that is not known."""
    if effects is None or not effects.motors:
        return []
    return [
        {
            "path": target.path,
            "max_error_m": float(effects.lag[k]),
            "sag_m": float(effects.droop[k]),
            "ideal_max_error_m": float(effects.ideal_lag[k]),
            "ideal_sag_m": float(effects.ideal_droop[k]),
        }
        for k, target in enumerate(character.targets)
    ]
