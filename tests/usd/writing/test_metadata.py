"""What a layer says about itself survives the file."""

from __future__ import annotations

import numpy as np
from calmotion import __version__
from calmotion.model import InputLayer, Provenance
from calmotion.usd import stages
from calmotion.usd.writing.metadata import author_origin, author_stage_metadata
from pxr import Sdf, Usd, UsdGeom, UsdPhysics

PROVENANCE = Provenance(
    shot="shot.usda",
    layers=(InputLayer("shot.usda", "ab"), InputLayer("../robot.usda", "cd")),
    meters_per_unit=0.01,
    kilograms_per_unit=0.5,
    up_axis="Y",
    time_codes_per_second=48.0,
    frames_per_second=24.0,
    start_time_code=10.0,
    end_time_code=90.0,
    default_prim="Arm",
)


def reopened(tmp_path, layer):
    layer.Export(str(tmp_path / "layer.usda"))
    return Sdf.Layer.FindOrOpen(str(tmp_path / "layer.usda"))


def test_units_axes_rates_and_range_are_those_of_the_shot(tmp_path):
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_stage_metadata(layer, PROVENANCE)
    layer = reopened(tmp_path, layer)
    stage = Usd.Stage.Open(layer)
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01 and UsdPhysics.GetStageKilogramsPerUnit(stage) == 0.5
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and layer.defaultPrim == "Arm"
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (48.0, 24.0)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (10.0, 90.0)


def test_the_origin_is_kept_with_plain_values_and_arrays(tmp_path):
    layer = Sdf.Layer.CreateAnonymous(".usda")
    author_origin(layer, stages.CURVES, PROVENANCE, settings={"step_s": 0.002, "reference": "rigid"})
    layer = reopened(tmp_path, layer)
    entry = layer.customLayerData["calmotion"]
    assert stages.role_of(layer) == stages.CURVES and entry["version"] == __version__
    assert list(entry["inputs"]) == ["shot.usda", "../robot.usda"] and list(entry["sha256"]) == ["ab", "cd"]
    assert np.isclose(entry["settings"]["step_s"], 0.002) and entry["settings"]["reference"] == "rigid"
