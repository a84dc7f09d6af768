"""`calmotion refine`: takes of a robot that differs from the shot, by which model and curves become better."""

import json

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion_plugins.calibration import refine
from calmotion_plugins.calibration.workflow.refine import takes_of
from pxr import Sdf, Usd
from small_shots import FORE, PLASTIC
from swung_plastic import ease, swung_plastic

TARGET = f"{FORE}/hand"
COARSE = {"fe.mesh.element_size": "40mm"}
NOISE, FRAMES = 1e-4, 26


def shot_at(path):
    return swung_plastic(path, lambda t: 30.0 * ease((t - 0.2) / 0.6), FRAMES)


def played(root, folder, name, number):
    """The real robot plays the curves of a root layer: its largest error, and a recording with noise."""
    stage = Usd.Stage.Open(str(root))
    over = Sdf.Layer.CreateAnonymous(".usda")
    stage.GetSessionLayer().subLayerPaths.append(over.identifier)
    stage.SetEditTarget(over)
    stage.GetPrimAtPath(PLASTIC).GetAttribute("physics:youngsModulus").Set(1.3e8)
    stage.GetPrimAtPath(PLASTIC).GetAttribute("calm:damping:ratio").Set(0.025)
    truth = folder / f"truth{number}.usda"
    layer = Sdf.Layer.CreateNew(str(truth))
    layer.TransferContent(over)
    layer.subLayerPaths = [str(root)]
    own = Sdf.Layer.FindOrOpen(str(root))
    for key in ("startTimeCode", "endTimeCode", "timeCodesPerSecond", "framesPerSecond", "defaultPrim"):
        setattr(layer, key, getattr(own, key))
    for key in ("metersPerUnit", "kilogramsPerUnit", "upAxis", "customLayerData"):
        layer.pseudoRoot.SetInfo(key, own.pseudoRoot.GetInfo(key))
    layer.Save()
    result = cm.simulate(truth, step="1ms", integrator="newmark", settings=COARSE)
    columns, random = result.columns(), np.random.default_rng(number)
    path = next(iter(result.targets))
    names = ["time_s", *(f"{path}.{axis}" for axis in "xyz")]
    rows = np.stack([columns[key] for key in names], axis=1)[::4]
    rows[:, 1:] += NOISE * random.standard_normal(rows[:, 1:].shape)
    lines = [",".join(names), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    (folder / name).write_text("\n".join(lines) + "\n")
    return result.max_error


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    folder = tmp_path_factory.mktemp("takes")
    shot = shot_at(folder / "shot.usda")
    cm.optimize(
        shot, tolerance="0.1mm", settings=COARSE, outputs=cm.OutputPaths(layer=str(folder / "take1.usda"))
    )  # fmt: skip
    return folder, played(folder / "take1_root.usda", folder, "take1.csv", 1)


@pytest.mark.long
def test_error_falls_fivefold_by_the_third_take(calmotion, first):
    folder, error = first
    errors, reports = [error], []
    for take in (1, 2):
        done = calmotion(
            "refine", folder / f"take{take}_root.usda", "--recording", folder / f"take{take}.csv", "-o",
            folder / f"take{take + 1}.usda", "--parameters", "modulus", "damping", "--tolerance", "0.1mm", "--json",
            "--set", "fe.mesh.element_size=40mm",
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        reports.append(json.loads(done.stdout))
        errors.append(played(folder / f"take{take + 1}_root.usda", folder, f"take{take + 1}.csv", take + 1))
    assert min(errors[1:]) < errors[0] / 5.0
    carried = [takes_of(str(folder / f"take{k}_root.usda")) for k in (2, 3)]
    assert [report["take"] for report in reports] == [1, 2] == carried
    (row,) = reports[0]["targets"]
    assert row["max_error_played_m"] == pytest.approx(errors[0], rel=0.15)
    assert row["expected_max_error_m"] == pytest.approx(errors[1], rel=1.0, abs=1e-4)
    assert row["max_error_m"] < 0.3 * row["max_error_played_m"]


def test_a_layer_of_the_shot_is_refused_before_the_model_is_written(tmp_path):
    shot = shot_at(tmp_path / "shot.usda")
    (tmp_path / "take.csv").write_text("time_s\n0\n")
    before = sorted(tmp_path.iterdir())
    with pytest.raises(ShotError, match=r"shot\.usda"):
        refine(shot, tmp_path / "take.csv", layer=shot)
    assert sorted(tmp_path.iterdir()) == before and takes_of(str(shot)) == 0
