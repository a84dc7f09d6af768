"""The benchmarks of the retargeting, on a small shot."""

import json

import pytest
from calmotion_plugins.benchmarks.common import reporting
from calmotion_plugins.benchmarks.optimizer import baselines, optimizer
from made_shots import plastic_shot


@pytest.mark.long
def test_gauss_newton_needs_a_fraction_of_a_quasi_newton_method(capsys, monkeypatch):
    monkeypatch.setattr(reporting, "load", lambda path: plastic_shot())
    assert optimizer.main(["arm.usda", "--lbfgs", "20", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    rows = {row["method"]: row for row in report["rows"]}
    ours = rows["Gauss-Newton"]
    assert ours["objective"] <= 1.01 * ours["converged"] and ours["simulations"] is not None
    assert ours["largest_after_mm"] < ours["largest_before_mm"] / 35
    assert rows["L-BFGS"]["seconds"] is None and rows["L-BFGS"]["objective"] > 1.1 * ours["converged"]
    assert rows["L-BFGS"]["evaluations"] == 20


@pytest.mark.long
def test_no_shaper_comes_near_the_optimised_curves(capsys, monkeypatch):
    monkeypatch.setattr(reporting, "load", lambda path: plastic_shot())
    assert baselines.main(["arm.usda", "--json"]) == 0
    rows = {row["method"]: row for row in json.loads(capsys.readouterr().out)["rows"]}
    assert set(rows) >= {"as animated", "zv", "zvd", "lowpass", "optimised"}
    best = rows["optimised"]
    assert best["delay_s"] == 0.0
    for method in ("zv", "zvd", "lowpass"):
        assert rows[method]["largest_mm"] > 5 * best["largest_mm"]
        assert rows[method]["delayed_largest_mm"] > 5 * best["largest_mm"]
    assert rows["zvd"]["delay_s"] > rows["zv"]["delay_s"] > 0.0
