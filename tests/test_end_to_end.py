"""The main job on the bartender through the command line: calmer tenfold, reproducible, within limits."""

import csv
import json
import math

import pytest
from pxr import Usd

CUP = "/Bartender/Cup/CupTarget"


@pytest.fixture(scope="module")
def run(calmotion_process, tmp_path_factory):
    """Folder and report of `calmotion demo`, which optimises the bartender."""
    folder = tmp_path_factory.mktemp("bartender")
    done = calmotion_process("demo", "-o", folder, "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    return folder, json.loads(done.stdout)


def test_the_demo_writes_a_layer_a_recording_a_table_and_pictures(run):
    folder, _ = run
    written = {path.name for path in folder.iterdir()}
    assert written == {
        "bartender.usda", "bartender_calm.usda", "bartender_calm_root.usda", "bartender.rrd", "bartender.csv",
        "bartender.html", "figures",
    }  # fmt: skip
    assert (folder / "figures" / "filmstrip.png").read_bytes().startswith(b"\x89PNG")


def target(report, path=CUP):
    return next(row for row in report["targets"] if row["path"] == path)


def test_largest_error_at_the_cup_falls_at_least_tenfold(run):
    _, report = run
    row = target(report)
    assert row["max_error_before_m"] > 0.02, "the input should shake visibly"
    assert row["max_error_after_m"] < 0.1 * row["max_error_before_m"]
    assert row["max_rotation_error_after_rad"] < 0.2 * row["max_rotation_error_before_rad"]


def test_joints_stay_closed_to_a_micrometre(run):
    assert run[1]["max_joint_gap_m"] < 1e-6


def test_report_has_the_keys_of_the_contract(run):
    keys = """targets objective_before objective_after forward_simulations gradients linearized_sweeps iterations wall_s
        total_wall_s simulate_wall_s steps step_s dof modes parameters layer left_out tolerance_m tolerance_kept
        error_budget""".split()
    assert not [key for key in keys if key not in run[1]]
    assert all(
        set(row) == {"source", "allowed_m", "estimated_m", "choice", "reason", "counted"}
        for row in run[1]["error_budget"]
    )
    assert all(set(row) == {"what", "why", "estimated_error_m", "skipped"} for row in run[1]["left_out"])


def test_root_layer_opens_with_the_new_curves_within_their_limits(run):
    folder, report = run
    stage = Usd.Stage.Open(report["root_layer"])
    assert not stage.GetCompositionErrors() and stage.GetDefaultPrim().GetName() == "Bartender"
    for motor in report["motors"]:
        prim = stage.GetPrimAtPath(motor["path"])
        drive = prim.GetAttribute("drive:angular:physics:targetPosition")
        low, high = (prim.GetAttribute(f"physics:{side}Limit").Get() for side in ("lower", "upper"))
        values = [drive.Get(code) for code in drive.GetTimeSamples()]
        assert len(values) == 97 and all(low - 1e-4 <= value <= high + 1e-4 for value in values)


def test_table_has_the_columns_of_the_contract_and_the_reported_maximum(run):
    folder, report = run
    with open(folder / "bartender.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[:6] == [
        "time_s",
        *(f"{report['targets'][0]['path']}.{name}" for name in "x y z error rotation_error".split()),
    ]
    for motor in report["motors"]:
        assert {f"{motor['path']}.{name}" for name in ("input", "output", "effort")} <= set(rows[0])
    errors = [float(row[f"{CUP}.error"]) for row in rows if float(row["time_s"]) >= 0.0]
    assert math.isclose(max(errors), target(report)["max_error_after_m"], rel_tol=1e-6)
    assert len(errors) == report["steps"]
