"""What `inspect` says of the gains in a sample, against the simulation of the sample with drives."""

import json

import pytest
from calmotion.usd.reading import read_shot
from pxr import Sdf, Usd
from sample_shots import path_of


@pytest.mark.long
def test_inspect_says_what_gains_would_do_within_5_percent_of_the_simulation_with_drives(calmotion, tmp_path):
    source = path_of("bartender")
    told = json.loads(calmotion("inspect", source, "--json").stdout)["effects_of_gains"]
    layer = tmp_path / "drives.usda"
    stage = Usd.Stage.Open(str(source))
    stage.Flatten().Export(str(layer))
    stage = Usd.Stage.Open(str(layer))
    for motor in read_shot(str(source))[0].motors:
        kind = Sdf.ValueTypeNames.Token
        stage.GetPrimAtPath(motor.path).CreateAttribute("calm:motor:model", kind).Set("drive")
    stage.Save()
    simulated = {}
    for name, shot in (("", layer), ("ideal_", source)):
        run = calmotion("simulate", shot, "--json")
        assert run.returncode == 0, run.stdout + run.stderr
        simulated[name] = max(row["max_error_m"] for row in json.loads(run.stdout)["targets"])
    for name, error in simulated.items():
        assert max(row[f"{name}max_error_m"] for row in told) == pytest.approx(error, rel=0.08 if name else 0.05)
    assert simulated[""] > 1.1 * simulated["ideal_"], "the gains matter"
