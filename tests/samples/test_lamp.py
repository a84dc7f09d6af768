"""The lamp, whose servos give: curves that are right for ideal motors fail on them, commands for them do not."""

import json

import pytest
from calmotion.catalogs.motor_types import motor_types
from calmotion.usd.reading import read_shot
from sample_shots import path_of

BULB = "/Lamp/Head/BulbTarget"


def test_the_lamp_has_the_motors_that_it_names():
    named = motor_types()["xm430-w350"]
    for motor in read_shot(str(path_of("lamp")))[0].motors:
        assert (motor.kind, motor.model) == ("xm430-w350", "servo")
        assert motor.position_gain == named.values["position_gain"] and motor.max_torque == named.values["max_torque"]
        assert motor.rotor.viscous_friction == named.values["viscous_friction"] and motor.backlash > 0.0


@pytest.mark.long
def test_curves_for_ideal_motors_visibly_fail_on_the_real_ones(calmotion, tmp_path):
    def error(layer):
        run = calmotion("simulate", layer, "--json")
        assert run.returncode == 0, run.stdout + run.stderr
        return next(row["max_error_m"] for row in json.loads(run.stdout)["targets"] if row["path"] == BULB)

    told = {}
    for name, more in (("ideal", ("--motors", "ideal")), ("real", ())):
        run = calmotion("optimize", path_of("lamp"), "-o", tmp_path / f"{name}.usda", "--json", *more)
        assert run.returncode == 0, run.stdout + run.stderr
        told[name] = json.loads(run.stdout)
    after = {name: report["targets"][0]["max_error_after_m"] for name, report in told.items()}
    assert after["ideal"] < 2e-3, "with ideal motors these curves would be right"
    nominal, real = error(told["ideal"]["root_layer"]), error(told["real"]["root_layer"])
    # `simulate` chooses a step and an integrator of its own
    assert real == pytest.approx(after["real"], abs=told["real"]["simulation_error_m"])
    assert nominal > 0.05 and real < 0.05 * nominal
    assert not [limit for limit in told["real"]["limits"] if limit["exceeded"]]
    shares = told["real"]["error_shares"][0]
    assert shares["motors_m"] > 5.0 * shares["links_m"] > 0.0
    lost = told["real"]["lost_motion"]
    assert sum(motor["reversals_after"] for motor in lost["motors"]) > 0
    assert 5e-4 < lost["targets"][0]["max_error_after_m"] < 5e-3
