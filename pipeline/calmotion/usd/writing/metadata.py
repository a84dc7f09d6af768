"""Metadata of a layer: that of the stage, and the origin in `customLayerData["calmotion"]`."""

from typing import Any

import numpy as np
from pxr import Sdf

from calmotion.model import Character, Provenance, Result
from calmotion.model.tolerance import verdict_on
from calmotion.usd import gf
from calmotion.usd.stages import METADATA_KEY
from calmotion.version import __version__

Entries = dict[str, Any]  # values that USD stores in layer metadata


def author_stage_metadata(layer: Sdf.Layer, provenance: Provenance) -> None:
    """The shot's units, axes, rates, range and default prim: a layer does not inherit them from its sublayers."""
    root = layer.pseudoRoot
    root.SetInfo("metersPerUnit", provenance.meters_per_unit)
    root.SetInfo("kilogramsPerUnit", provenance.kilograms_per_unit)
    root.SetInfo("upAxis", provenance.up_axis)
    layer.timeCodesPerSecond = provenance.time_codes_per_second
    layer.framesPerSecond = provenance.frames_per_second
    layer.startTimeCode = provenance.start_time_code
    layer.endTimeCode = provenance.end_time_code
    if provenance.default_prim:
        layer.defaultPrim = provenance.default_prim


def author_origin(
    layer: Sdf.Layer,
    role: str,
    provenance: Provenance,
    *,
    settings: Entries | None = None,
    errors: Entries | None = None,
) -> None:
    """Record version, role, input layers with their hashes, settings and errors."""
    entry: Entries = {
        "version": __version__,
        "role": role,
        "inputs": gf.to_strings(source.path for source in provenance.layers),
        "sha256": gf.to_strings(source.sha256 for source in provenance.layers),
    }
    if settings:
        entry["settings"] = settings
    if errors:
        entry["errors"] = errors
    layer.customLayerData = {**layer.customLayerData, METADATA_KEY: entry}


def settings_of(
    character: Character, result: Result, bake: str, samples_per_second: float | None, splines: bool = False
) -> Entries:
    """The settings that a result was computed and written with, as plain values that USD stores."""
    retarget = character.retarget
    entries: Entries = {
        "step_s": float(result.step_s),
        "pre_roll_s": float(result.pre_roll_s),
        "reference": retarget.reference,
        "endpoints": retarget.endpoints,
        "cyclic": retarget.cyclic,
        "bake": bake,
        "splines": splines,
    }
    verdict = verdict_on(result.budget, result.tolerance_m)
    if result.budget:
        entries["tolerance_kept"] = verdict.kept
        entries["error_budget_m"] = {entry.source: float(entry.estimated_m or 0.0) for entry in result.budget}
    for name, value in (
        ("tolerance_m", result.tolerance_m),
        ("knot_spacing_s", retarget.knot_spacing),
        ("smoothness", retarget.smoothness),
        ("samples_per_second", samples_per_second),
    ):
        if value is not None:
            entries[name] = float(value)
    return entries


def errors_of(character: Character, result: Result) -> Entries:
    """Errors of each target before and after, in the order of `targets`."""
    entries: Entries = {"targets": gf.to_strings(target.path for target in character.targets)}
    for name, simulation in (("before", result.before), ("after", result.after)):
        if simulation is None:
            continue
        counted = simulation.motion.judged
        for quantity, unit, values in (
            ("error", "m", simulation.position_errors[counted]),
            ("rotation_error", "rad", simulation.rotation_errors[counted]),
        ):
            entries[f"max_{quantity}_{name}_{unit}"] = gf.to_doubles(np.max(values, axis=0))
            entries[f"rms_{quantity}_{name}_{unit}"] = gf.to_doubles(np.sqrt(np.mean(values**2, axis=0)))
    entries["objective_before"] = float(result.objective_before)
    if result.objective_after is not None:
        entries["objective_after"] = float(result.objective_after)
    return entries
