"""The JSON report of a calibration."""

import json

import numpy as np
from calmotion.model.outputs import WrittenLayer
from calmotion_plugins.calibration.model.estimates import Calibration, ChannelFit, Estimate
from calmotion_plugins.calibration.workflow.report import calibration_report


def test_the_report_has_the_keys_of_the_contract_and_no_nan():
    item = Estimate("centre", "/Arm/Hand", 1, "m", 0.0, 0.01, 0.004, 0.001, False, True)
    fit = ChannelFit("a.csv", "marker /Arm/Hand", "m", 30, 0, 1e-3, 5e-3, 1e-3, float("nan"), 0)
    made = Calibration(
        (item,), np.array([[1e-6]]), {"a.csv": "00"}, (fit,), (), True, 3, 20, 1e-3, 0.1, 2.0, ("a note",)
    )
    report = calibration_report(made, WrittenLayer("r.usda", "r_root.usda"), ("f.png",), 3.0)
    json.dumps(report, allow_nan=False)
    (row,) = report["parameters"]
    assert row["name"] == "centre /Arm/Hand.y" and row["path"] == "/Arm/Hand" and row["identifiable"]
    assert row["prior"] == {"value": 0.0, "standard_deviation": 0.01} and row["value"] == 0.004
    assert report["residual_rms"] == {"marker /Arm/Hand": 1e-3} and report["validation_rms"] == {
        "marker /Arm/Hand": None
    }
    assert report["layer"] == "r.usda" and report["correlations"] == [[1.0]] and report["notes"] == ["a note"]
