"""The benchmark of the reduction, on small links."""

import re

import numpy as np
import pytest
from calmotion.benchmarks.speed.reduction import SHAPES, box_mesh, main, measure, report


@pytest.mark.parametrize("shape", SHAPES)
def test_the_measured_values_of_a_small_link_are_right(shape):
    result = measure(shape, 1500, 10)
    assert 0.8 * 1500 < result["nodes"] < 1.25 * 1500
    assert result["residual"] < 1e-7 and result["orthonormality"] < 1e-10
    assert 0.0 < result["frequencies"][0] < result["frequencies"][1]
    assert result["memory"] > 8e-9 * result["factor"] or np.isnan(result["memory"])
    text = report(shape, result)
    assert f"{result['nodes']} nodes" in text and "peak memory" in text


def test_a_box_mesh_fills_its_extent_with_about_the_requested_number_of_nodes():
    for size in SHAPES.values():
        points, tets = box_mesh(size, 5000)
        assert np.allclose(np.ptp(points, axis=0), size)
        corners = points[tets]
        volume = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6.0
        assert volume == pytest.approx(np.prod(size))


def test_the_command_prints_one_report_a_shape(capfd, monkeypatch, repository):
    monkeypatch.setenv("PYTHONPATH", str(repository / "pipeline"))
    assert main(["--nodes", "600", "--modes", "4", "--shape", "bulky"]) == 0
    out = capfd.readouterr().out
    assert re.search(r"bulky link: \d+ nodes", out) and "slender" not in out
    assert re.search(r"4 fixed-interface modes +\d", out)
