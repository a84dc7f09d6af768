"""The scaling benchmark: its numbers on small sizes, and what it says without Exudyn. Nothing here is about seconds."""

import json

import numpy as np
from calmotion_plugins.benchmarks.speed import exudyn_arm, scaling
from calmotion_plugins.benchmarks.speed.scaling import Growth


def test_the_simulated_arm_converges_at_second_order():
    code = exudyn_arm.Ours("bdf2")
    exact, _ = code.run(3840)
    errors = [np.abs(code.run(steps)[0] - exact).max() for steps in (240, 480)]
    assert 1.7 < np.log2(errors[0] / errors[1]) < 2.3


def test_without_the_others_the_command_says_so_and_goes_on(capsys, monkeypatch):
    monkeypatch.setattr(scaling, "find_spec", lambda name: None)
    monkeypatch.setattr(scaling, "growths", lambda *sizes: [Growth("bodies", (4, 8), (1e-4, 2e-4))])
    assert scaling.main([]) == 0
    out = capsys.readouterr().out
    assert "install the extra `bench`" in out and "exponent 1.00" in out
    assert scaling.main(["--json", "--quick"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["tree_step_s"] > 0.0 and report["exudyn"] == [] and report["growth"][0]["name"] == "bodies"
