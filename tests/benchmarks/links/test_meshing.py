"""The table of time and error against element size, on a link small enough to be meshed in seconds."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest
from calmotion.benchmarks.links import meshing, survey
from calmotion.benchmarks.scenes.links import read_links
from calmotion.benchmarks.scenes.mesher import mesher
from calmotion.errors import ShotError
from odd_jobs import odd_survey
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


@pytest.mark.long
def test_the_table_shows_errors_that_decrease_towards_the_finest_mesh(shot, tmp_path, capsys):
    file = tmp_path / "table.csv"
    assert meshing.main([f"{shot}:fore", "--sizes", "40mm", "16mm", "auto", "-o", str(file)]) == 0
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
    assert all(float(fine[name]) > 0.0 for name in ("mesh_time", "reduce_time"))
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].startswith("| fore | auto |") and lines[3].startswith("| fore | 40 |")
    assert lines[-1].startswith("fore: ") and lines[-1].endswith("% over 3 meshes")


def test_the_automatic_mesh_is_judged_by_the_finest_one():
    rows = [
        meshing.Row("fore", size, nodes, 1.0, 1.0, f1, 2.0 * f1, 3.0 * f1, np.nan, 9.0, 0.1, "joint")
        for size, nodes, f1 in ((np.nan, 900, 103.0), (8.0, 500, 110.0), (2.0, 50_000, 100.0))
    ]
    rows = meshing._compared(rows)
    assert [row.error for row in rows] == pytest.approx([3.0, 10.0, np.nan], nan_ok=True)
    assert meshing.verdicts(rows) == (
        "fore: the automatic mesh is 3% off the finest one (50000 nodes), 9% are estimated; the first frequency "
        "spreads by 10% over 3 meshes\n"
    )
    assert meshing.verdicts(rows[:1]) == ""
    assert meshing.table(rows).splitlines()[2].startswith("| fore | auto | 900 |")


def test_links_that_cannot_be_meshed_are_reported_and_the_others_are_measured(shot, tmp_path, capsys):
    assert meshing.main([f"{shot}:foot", "--sizes", "1"]) == 1
    assert "no such link" in capsys.readouterr().err


def test_a_refined_row_is_named_and_judges_the_automatic_mesh(shot, tmp_path):
    (fore,) = read_links(f"{shot}:fore")
    auto, refined = meshing.study(fore, ["auto"], 60.0, print, refine=6_000)
    assert np.isnan(auto.size) and refined.size == 0.0 and np.isnan(refined.reduce_time)
    assert refined.nodes > auto.nodes and 0.0 < auto.error < 2.0 and refined.estimate < auto.estimate
    assert "| fore | refined |" in meshing.table([auto, refined])
    assert "the automatic mesh" in meshing.verdicts([auto, refined])


def test_sizes_are_multiples_of_the_automatic_one_or_lengths():
    assert meshing._length("1.4", 0.01) == pytest.approx(0.014)
    assert meshing._length("8mm", 0.01) == pytest.approx(0.008)


@pytest.mark.long
def test_the_survey_has_a_row_for_each_link_and_says_what_became_of_it(shot, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "cache"))
    file = tmp_path / "links.csv"
    made = tmp_path / "meshing.md"
    assert meshing.main([f"{shot}:fore", "-o", str(file), "--pictures", "fore", "--page", str(made)]) == 0
    with open(file, newline="") as text:
        (row,) = csv.DictReader(text)
    assert (row["link"], row["source"], row["note"]) == ("fore", "visual surface", "")
    assert float(row["volume"]) == pytest.approx(1e6 * LENGTH * WIDTH**2, rel=1e-6)
    assert float(row["of_hull"]) == pytest.approx(1.0) and int(row["off"]) == 0 and int(row["joints"]) >= 1
    assert float(row["density"]) == pytest.approx(1e6 * float(row["mass"]) / float(row["volume"]))
    beam = 3.516 / (2.0 * np.pi) * np.sqrt(1.8e9 * WIDTH**2 / 12.0 / 1200.0) / LENGTH**2
    assert float(row["f1"]) == pytest.approx(beam, rel=0.03)
    assert int(row["nodes"]) > 100 and float(row["seconds"]) > 0.0 and float(row["estimate"]) < 5.0
    printed = capsys.readouterr().out
    assert "1 of 1 links are flexible (100%)" in printed and "| fore | visual surface |" in printed
    text = made.read_text()
    assert "1 of 1 links are flexible" in text and "calmotion bench meshing arm.usda --pictures fore" in text
    assert "![arm, fore](meshing/arm_fore.png)" in text
    assert (tmp_path / "meshing" / "arm_fore.png").read_bytes()[:4] == b"\x89PNG"


def test_a_link_that_is_refused_says_why_and_one_whose_process_ends_too(shot, tmp_path, capsys, monkeypatch):
    (fore,) = read_links(f"{shot}:fore")
    whole = fore.body.surfaces[0]
    flat = replace(fore, body=replace(fore.body, surfaces=(replace(whole, triangles=whole.triangles[:1]),)))
    row = survey.survey_row(replace(flat, mass=None), "arm", mesher(), 60.0, True)
    assert row.source == "refused" and "open surface" in row.note and "Close the mesh" in row.note
    monkeypatch.setattr(meshing, "survey_link", odd_survey)
    file = tmp_path / "links.csv"
    assert meshing.main([str(shot), "--geometry-only", "-o", str(file)]) == 0
    with open(file, newline="") as text:
        rows = {row["link"]: row for row in csv.DictReader(text)}
    assert rows["fore"]["source"] == "fault" and "SIGSEGV" in rows["fore"]["note"]
    assert "Give a TetMesh" in rows["fore"]["note"] and rows["upper"]["source"] == "visual surface"
    heard = capsys.readouterr()
    assert "fault: its process ended (signal SIGSEGV)" in heard.err and "min left" in heard.err
    assert "arm fore: its process ended" in heard.out
