"""`calmotion calibrate` from a USD shot and files of recordings to a layer."""

import json

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from calmotion_plugins.calibration import calibrate
from small_shots import BASE, FORE, HAND, PLASTIC
from swung_plastic import ease, swung_plastic

TRUTH = {"youngsModulus": 1.15e8, "damping": 0.02}


def shot_at(path, *material):
    """The shoulder makes two moves from rest to rest."""
    return swung_plastic(path, lambda t: 30.0 * ease((t - 0.1) / 0.25) - 20.0 * ease((t - 0.5) / 0.2), 24, *material)


@pytest.fixture(scope="module")
def take(tmp_path_factory):
    """A shot, and what a robot of other parameters does, as `simulate --csv` writes it, with noise."""
    folder = tmp_path_factory.mktemp("take")
    truth = shot_at(folder / "truth.usda", TRUTH["youngsModulus"], TRUTH["damping"])
    result = cm.simulate(truth, step="0.5ms", integrator="newmark")
    columns = result.columns()
    rng = np.random.default_rng(4)
    names = ["time_s", *(f"{HAND}.{axis}" for axis in "xyz")]
    rows = np.stack([columns[name] for name in names], axis=1)[::4]
    rows[:, 1:] += 1e-4 * rng.standard_normal(rows[:, 1:].shape)
    lines = [",".join(names), *(",".join(f"{value:.9g}" for value in row) for row in rows)]
    (folder / "take.csv").write_text("\n".join(lines) + "\n")
    return shot_at(folder / "shot.usda"), folder / "take.csv"


def test_the_command_writes_a_layer_with_the_parameters_of_the_robot(calmotion, take, tmp_path):
    shot, recording = take
    done = calmotion(
        "calibrate", shot, "--recording", recording, "-o", tmp_path / "robot.usda", "--json", "--parameters", "modulus",
        "damping", "--figures", tmp_path / "figures", "--html", tmp_path / "page.html",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    found = {row["name"]: row for row in report["parameters"]}
    modulus, damping = found[f"modulus {PLASTIC}"], found[f"damping {PLASTIC}"]
    assert modulus["value"] == pytest.approx(TRUTH["youngsModulus"], rel=0.01) and modulus["identifiable"]
    assert damping["value"] == pytest.approx(TRUTH["damping"], rel=0.1)
    # most of the width is what the mesh is claimed to be off by
    assert modulus["prior"]["value"] == pytest.approx(1e8) and modulus["standard_deviation"] < 0.03 * modulus["value"]
    channel = f"marker {HAND}"
    assert report["residual_rms"][channel] == pytest.approx(1e-4, rel=0.2)
    assert report["validation_rms"][channel] == pytest.approx(1e-4, rel=0.4)
    assert {row["file"] for row in report["recordings"]} == {str(recording)}
    material = next(b for b in read_shot(report["root"])[0].bodies if b.path == FORE).flexible.material
    assert material.youngs_modulus == pytest.approx(modulus["value"], rel=1e-6)
    assert sorted(p.name for p in (tmp_path / "figures").iterdir()) == [
        "intervals.png", "measured.png", "residual_spectra.png",
    ]  # fmt: skip
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "The recordings identify 2 of 2 parameters" in page and "Measured and simulated" in page


def test_what_does_not_fit_is_refused_before_any_mesh(calmotion, take, tmp_path):
    shot, recording = take
    other = tmp_path / "other.csv"
    for name, match in (("/Arm/fore/hant", "/Arm/fore/hand"), ("/Arm", "must be on a body")):
        other.write_text(recording.read_text().replace(HAND, name))
        done = calmotion("calibrate", shot, "--recording", other, "-o", tmp_path / "robot.usda")
        assert done.returncode == 1 and match in done.stderr and "mesh" not in done.stderr.lower()
    other.write_text(recording.read_text().replace(f"{HAND}.x", "/Arm/joints/elbo.angle"))
    done = calmotion("calibrate", shot, "--recording", other)
    assert done.returncode == 1 and "/Arm/joints/elbow" in done.stderr
    assert calmotion("calibrate", shot, "--recording", tmp_path / "none.csv").returncode == 2
    assert calmotion("calibrate", shot, "--recording", recording, "-o", shot).returncode == 1
    assert calmotion("calibrate", shot).returncode == 2
    for arguments, match in (
        (("--recording", recording), "no shot is named"),
        ((shot, "--shot", shot, "--recording", recording), "named twice"),
        (("--shot", shot, "--shot", shot, "--recording", recording), "has no recording"),
        (("--shot", shot, "--recording", recording, "--shot", shot, "--recording", recording), "given twice"),
    ):
        done = calmotion("calibrate", *arguments)
        assert done.returncode == 2 and match in done.stderr
    with pytest.raises(ShotError, match="modulus"):
        calibrate(shot, recording, parameters=("modul",))


def test_a_shot_that_is_calibrated_keeps_its_own_targets(take):
    shot, recording = take
    opened = cm.open_shot(shot)
    text = recording.read_text().replace(HAND, BASE)
    other = recording.with_name("base.csv")
    other.write_text(text)
    # the base hardly moves: nothing is identifiable, and the base is no target of the shot afterwards
    made = calibrate(opened, other, parameters=("modulus",), step="4ms", settings={"fe.mesh.element_size": "40mm"})
    assert opened.targets == (HAND,)
    assert not made.parameters[f"modulus {PLASTIC}"].identifiable
