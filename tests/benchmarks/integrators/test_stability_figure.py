"""Pictures of the maps of stability."""

from calmotion.benchmarks.integrators.outcomes import FAILED, REFUSED, RUNS
from calmotion.benchmarks.integrators.stability_figure import COLORS, draw_map
from calmotion.benchmarks.integrators.stability_map import Cell


def lightness(color):
    return sum(int(color[k : k + 2], 16) * share for k, share in ((1, 0.299), (3, 0.587), (5, 0.114)))


def test_a_map_is_drawn(tmp_path):
    cells = [
        Cell("load", value, step, integrator, outcome, "", 1e-3 if outcome == RUNS else None, 0.1)
        for integrator in ("bdf2", "rk4")
        for value, outcomes in ((1.0, (RUNS, RUNS)), (2.0, (FAILED, RUNS)), (3.0, (REFUSED, REFUSED)))
        for step, outcome in zip((1 / 24, 1 / 48000), outcomes, strict=True)
    ]
    path = draw_map(str(tmp_path / "new"), "load", "load [-]", cells)
    assert path.endswith("stability_load.png")
    assert (tmp_path / "new" / "stability_load.png").read_bytes()[:4] == b"\x89PNG"


def test_outcomes_differ_in_lightness_from_what_has_failed():
    assert min(lightness(COLORS[RUNS]), lightness(COLORS[REFUSED])) > 2.0 * lightness(COLORS[FAILED])
