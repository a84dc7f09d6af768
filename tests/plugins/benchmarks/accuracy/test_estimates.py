"""Random shots by error over estimate: drawn alike every time, measured against regular meshes."""

import csv
import json

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion_plugins.benchmarks.accuracy import estimates
from calmotion_plugins.benchmarks.accuracy.estimates import Judged, counts, drawn


def row(number, ratio, reference=1e-5):
    return Judged(number, 1e-3, 1e-3, 2e-4, ratio * 1e-3, reference, 600, 5000)


def test_a_shot_is_known_by_its_number():
    one, again, other = drawn(3), drawn(3), drawn(4)
    assert one.tolerance == again.tolerance != other.tolerance
    assert np.array_equal(one.meshes.meshes[0].points, again.meshes.meshes[0].points)
    assert all(mesh.quality.frequency_error <= estimates.MESH_ACCURACY for mesh in one.meshes.meshes)


def test_meshes_of_a_reference_are_regular_and_of_the_same_links():
    shot = drawn(3)
    for own, finer in zip(shot.meshes.meshes, shot.regular_meshes(2, 2).meshes, strict=True):
        assert np.ptp(finer.points, axis=0) == pytest.approx(np.ptp(own.points, axis=0)) and finer.body == own.body
        assert len(np.unique(finer.points[:, 0].round(9))) == 2 * shot.cells + 1
        assert len(np.unique(finer.points[:, 1].round(9))) == 3


def test_links_that_are_alike_take_the_same_stiffness_from_finer_meshes():
    """Loads choose other bases on finer meshes of the first link: it took a factor of 0.925, the other one 0.982."""
    shot = drawn(145)
    options = estimates.RunSettings(tolerance=shot.tolerance)
    reduction = estimates.reduction_for(shot.character, shot.animation, shot.meshes, options)
    finer = reduction.with_finer_meshes(shot.tolerance, {0: 1e-4, 1: 1e-4}, 2500)
    first, second = (mesh.quality.stiffness_factor for mesh in finer.meshes.meshes)
    assert first == pytest.approx(second, rel=1e-3) and 0.97 < first < 0.99


def test_every_shot_is_counted_once():
    table = counts([row(k, ratio) for k, ratio in enumerate([0.01, 0.3, 0.4, 0.9, 1.2, 7.0])])
    assert [int(n) for _, n, _ in table[:-1]] == [1, 0, 0, 2, 1, 1, 1, 0, 3, 3]
    assert table[0][0] == "0 to 0.05" and table[6] == ["above 1.5", "1", "17%"]
    assert [table[-3], table[-1]] == [["0.05 to 1", "3", "50.0%"], ["largest", "7.00", "-"]]


def test_shots_at_a_border_may_be_on_either_side_of_it():
    """Of an estimate of 1 mm: 0.04, 0.04, 1.1 and 1.1 mm, known to 0.02, 0.005, 0.2 and 0.05 mm."""
    cases = ((0.04, 2e-5), (0.04, 5e-6), (1.1, 2e-4), (1.1, 5e-5), (0.5, 1e-5))
    rows = [row(k, ratio, reference) for k, (ratio, reference) in enumerate(cases)]
    assert [one.may_be_honest for one in rows] == [True, False, True, False, True]
    assert counts(rows)[-3:-1] == [
        ["0.05 to 1", "1", "20.0%"],
        ["0.05 to 1, as far as the reference is known", "3", "60.0%"],
    ]


def test_a_reference_known_to_half_of_what_it_judges_decides():
    rows = [row(0, 0.2, 4e-4), row(1, 0.2, 6e-4), row(2, 3.0, 1e-3), row(3, 3.0, 2e-3)]
    assert [one.decides for one in rows] == [True, False, True, False]
    table = dict((name, number) for name, number, _ in counts(rows))
    assert table["undecided"] == "2" and table["above 1.5"] == "1" and table["0.05 to 1"] == "1"
    assert counts([rows[1]])[-1] == ["largest", "0.00", "-"]


@pytest.mark.parametrize(("ratio", "reference", "status"), [(0.4, 1e-5, 0), (1.6, 1e-5, 1), (1.6, 1e-3, 0)])
def test_the_command_fails_where_an_error_is_far_above_its_estimate(
    monkeypatch, capsys, tmp_path, ratio, reference, status
):
    def judged(number):
        if number == 1:
            raise ShotError("it bends too far", path="/Arm")
        return row(number, ratio, reference)

    monkeypatch.setattr(estimates, "judged", judged)
    files = ["--csv", str(tmp_path / "rows.csv"), "--markdown", str(tmp_path / "table.md")]
    assert estimates.main(["--count", "3", "--json", *files]) == status
    out, err = capsys.readouterr()
    assert [r["ratio"] for r in json.loads(out)["rows"]] == pytest.approx([ratio, ratio]) and "refused" in err
    with open(tmp_path / "rows.csv", newline="") as file:
        assert [int(r["shot"]) for r in csv.DictReader(file)] == [0, 2]
    assert (tmp_path / "table.md").read_text().startswith("| error over estimate | shots | share |")


def test_a_campaign_goes_on_with_the_shots_that_its_table_does_not_have(monkeypatch, tmp_path):
    measured = []

    def judged(number):
        measured.append(number)
        return row(number, 0.5)

    monkeypatch.setattr(estimates, "judged", judged)
    resumed = ["--csv", str(tmp_path / "rows.csv"), "--resume"]
    assert estimates.main(["--first", "2", "--count", "2", *resumed]) == 0
    assert estimates.main(["--count", "4", *resumed]) == 0 and measured == [2, 3, 0, 1]
    with open(tmp_path / "rows.csv", newline="") as file:
        assert [int(r["shot"]) for r in csv.DictReader(file)] == [0, 1, 2, 3]
    with pytest.raises(SystemExit):
        estimates.main(["--resume"])
