"""The survey of the links of robots: a row each, whatever becomes of one of them."""

from __future__ import annotations

import csv
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion_plugins.benchmarks.links import meshing, survey
from calmotion_plugins.benchmarks.scenes.links import links_of_all, read_links
from small_shots import ELBOW, FORE, LENGTH, UPPER, WIDTH, write_arm


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    return write_arm(tmp_path_factory.mktemp("arm") / "arm.usda")


@pytest.mark.long
def test_the_survey_has_a_row_for_each_link_and_says_what_became_of_it(shot, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "cache"))
    file = tmp_path / "links.csv"
    assert meshing.main([f"{shot}:fore", "--reference", "--csv", str(file)]) == 0
    with open(file, newline="") as text:
        (row,) = csv.DictReader(text)
    assert (row["link"], row["source"], row["note"]) == ("fore", "visual surface", "")
    assert float(row["volume_cm3"]) == pytest.approx(1e6 * LENGTH * WIDTH**2, rel=1e-6)
    assert int(row["off"]) == 0 and int(row["joints"]) >= 1
    beam = 3.516 / (2.0 * np.pi) * np.sqrt(1.8e9 * WIDTH**2 / 12.0 / 1200.0) / LENGTH**2
    assert float(row["f1_hz"]) == pytest.approx(beam, rel=0.03)
    assert int(row["nodes"]) > 100 and float(row["processor_s"]) > 0.0 and float(row["estimate_percent"]) < 5.0
    assert 0.5 < float(row["by_sections_hz"]) / float(row["f1_hz"]) < 2.0
    assert 0.0 < float(row["difference_percent"]) < float(row["estimate_percent"]) + 0.2
    printed = capsys.readouterr().out
    assert "within 2% for 100% of 1 links" in printed
    assert "1 of 1 links are flexible (100%)" in printed and "visual surface" in printed


def test_a_link_that_is_refused_says_why_and_one_whose_process_ends_too(shot, tmp_path, capsys, monkeypatch):
    (fore,) = read_links(f"{shot}:fore")
    whole = fore.body.surfaces[0]
    flat = replace(fore, body=replace(fore.body, surfaces=(replace(whole, triangles=whole.triangles[:1]),)))
    row = survey.survey_link(replace(flat, mass=None), "arm", 60.0, True)
    assert row.source == "refused" and "open surface" in row.note and "Close the mesh" in row.note
    monkeypatch.syspath_prepend(str(Path(__file__).parent))  # where processes find it, too
    monkeypatch.setattr(meshing, "survey_link", import_module("odd_survey").odd_survey)
    file = tmp_path / "links.csv"
    assert meshing.main([str(shot), "--geometry-only", "--csv", str(file)]) == 0
    with open(file, newline="") as text:
        rows = {row["link"]: row for row in csv.DictReader(text)}
    assert rows["fore"]["source"] == "fault" and "SIGSEGV" in rows["fore"]["note"]
    assert "Give a TetMesh" in rows["fore"]["note"] and rows["upper"]["source"] == "visual surface"
    heard = capsys.readouterr()
    assert "fault: its process ended (signal SIGSEGV)" in heard.err and "min left" in heard.err
    assert "arm fore: its process ended" in heard.out


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
