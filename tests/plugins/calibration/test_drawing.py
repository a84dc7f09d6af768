"""Figures of a calibration."""

from pathlib import Path

import numpy as np
from calmotion.model.run import OutputPaths
from calmotion.testing import host_with, run_operator
from calmotion_plugins.calibration import drawing
from calmotion_plugins.calibration.model.estimates import Calibration, ChannelCurves, Estimate


def test_a_calibration_is_drawn_with_what_was_measured_and_the_intervals(repository, tmp_path):
    times = np.linspace(0.0, 1.0, 50)
    curve = ChannelCurves(
        "a.csv", "marker /Arm/Hand", "m", times, np.ones((50, 3)), np.zeros((50, 3)), np.ones((50, 3)), times > 0.8
    )
    items = tuple(
        Estimate("modulus", f"/Arm/{name}", -1, "Pa", 2e9, 6e8, 2.3e9, 1e7, True, told)
        for name, told in (("A", True), ("B", False))
    )
    made = Calibration(items, np.eye(2), {"a.csv": "0"}, (), (curve,) * 5, True, 1, 1, 1e-3, 0.1, 1.0)
    values = [made, OutputPaths(figures=str(tmp_path))]
    host = host_with(repository / "plugins" / "calibration")
    drawn = run_operator(host, "figures.calibration", values)[0].paths
    names = ["measured_1.png", "measured_2.png", "residual_spectra.png", "intervals.png"]
    assert [Path(path).name for path in drawn] == names and all(Path(path).stat().st_size > 5000 for path in drawn)
    axes = drawing.plot_signals((curve,)).axes
    assert len(axes) == 3 and axes[0].get_title(loc="left") == "marker Hand x"
    ticks = [text.get_text() for text in drawing.plot_intervals(made).axes[0].get_yticklabels()]
    assert ticks == ["modulus A", "modulus B"]
