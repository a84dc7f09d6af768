"""The table of time and error against element size, on a link small enough to be meshed in seconds."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion_plugins.benchmarks.links import meshing
from calmotion_plugins.benchmarks.scenes.links import links_of_all, read_links
from small_shots import ELBOW, FORE, LENGTH, UPPER, WIDTH, write_arm


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return write_arm(tmp_path_factory.mktemp("arm") / "arm.usda")


def test_links_are_named_by_path_or_name_or_taken_all(shot):
    assert [link.body.path for link in read_links(f"{shot}:fore")] == [FORE]
    assert [link.body.path for link in read_links(f"{shot}:{UPPER}")] == [UPPER]
    (fore,) = read_links(f"{shot}:fore")
    assert fore.body.flexible is not None and len(fore.body.surfaces) == 1
    assert fore.carrier is not None and fore.carrier.position == pytest.approx([0.0, 0.0, 0.0]), ELBOW
    assert {link.name for link in read_links(str(shot))} >= {"upper", "fore"}
    with pytest.raises(ShotError, match="no such link"):
        read_links(f"{shot}:foot")
    told = []
    found = links_of_all([f"{shot}:foot", f"{shot}:fore"], told.append)
    assert [(link.body.path, robot) for link, robot in found] == [(FORE, "arm")]
    assert len(told) == 1 and "no such link" in told[0], "one that is not there does not keep the others away"


@pytest.mark.long
def test_the_table_shows_errors_that_decrease_towards_the_finest_mesh(shot, tmp_path, capsys):
    file = tmp_path / "table.csv"
    assert meshing.main([f"{shot}:fore", "--sizes", "40mm", "16mm", "auto", "--csv", str(file)]) == 0
    with open(file, newline="") as text:
        auto, coarse, fine = csv.DictReader(text)
    assert np.isnan(float(auto["size"])) and float(auto["f1"]) == pytest.approx(float(fine["f1"]), rel=0.02)
    assert [float(row["size"]) for row in (coarse, fine)] == pytest.approx([40.0, 16.0])
    assert coarse["held"] == fine["held"] == "joint"
    assert int(coarse["nodes"]) < int(fine["nodes"])
    # a clamped beam: f1 = 3.516 / (2 pi) sqrt(E I / (rho A L^4))
    beam = 3.516 / (2.0 * np.pi) * np.sqrt(1.8e9 * WIDTH**2 / 12.0 / 1200.0) / LENGTH**2
    assert float(fine["f1"]) == pytest.approx(beam, rel=0.03)
    assert float(coarse["error"]) > 0.0 and np.isnan(float(max(auto, fine, key=lambda r: int(r["nodes"]))["error"]))
    assert float(coarse["estimate"]) > float(fine["estimate"]) > 0.0
    assert float(fine["mesh_time"]) > 0.0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].startswith("| fore | auto |") and lines[3].startswith("| fore | 40 |")
    assert lines[-1].startswith("fore: ") and lines[-1].endswith("% over 3 meshes")


def test_a_refined_row_is_named_and_judges_the_automatic_mesh(shot, tmp_path):
    (fore,) = read_links(f"{shot}:fore")
    auto, refined = meshing.study(fore, ["auto"], 60.0, refine=6_000)
    assert np.isnan(auto.size) and refined.size == 0.0
    assert refined.nodes > auto.nodes and 0.0 < auto.error < 2.0 and refined.estimate < auto.estimate
    assert "| fore | refined |" in meshing.table([auto, refined])
    assert "the automatic mesh" in meshing.verdicts([auto, refined])
