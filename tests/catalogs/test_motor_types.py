"""The table of real motors, and tables of the user."""

import math

import pytest
from calmotion import ShotError
from calmotion.catalogs.motor_types import (
    GROUPS,
    QUANTITIES,
    likely_motor_types,
    motor_type_named,
    motor_types,
    read_motor_types,
)

SHIPPED = motor_types()


@pytest.mark.parametrize("name", SHIPPED)
def test_every_number_of_the_table_has_a_source(name):
    motor = SHIPPED[name]
    assert motor.values and motor.group in GROUPS and motor.title
    assert set(motor.sources) == set(motor.values)
    assert not [key for key, source in motor.sources.items() if source == "the user"]


def test_values_are_si_and_found_by_any_name_of_the_motor():
    motor = motor_type_named("XM430_W350-R", SHIPPED)
    assert motor is SHIPPED["xm430-w350"]
    assert motor.get("max_speed", 0.0) == pytest.approx(46.0 * 2 * math.pi / 60.0)
    assert motor.get("backlash", 0.0) == pytest.approx(math.radians(0.25))
    assert motor.get("gear_stiffness", math.inf) == math.inf, "not known"
    assert motor.in_table("max_speed") == pytest.approx(46.0) and motor.unit("max_speed") == "rev/min"


@pytest.mark.parametrize(("name", "voltage_rpm"), [("mx-64", 63.0), ("mx-106", 45.0), ("sts3215", 53.0)])
def test_identified_motors_without_load_run_about_as_fast_as_their_data_sheets_say(name, voltage_rpm):
    """Two independent sources: largest torque over viscous friction and back-EMF, and the data sheet."""
    motor = SHIPPED[name]
    speed = (motor.get("max_torque", 0.0) - motor.get("friction", 0.0)) / motor.get("viscous_friction", 1.0)
    assert speed * 60.0 / (2 * math.pi) == pytest.approx(voltage_rpm, rel=0.1)


@pytest.mark.parametrize("size", ["17c", "25c", "32c", "40c"])
def test_inertias_of_strain_wave_actuators_grow_with_the_square_of_the_ratio(size):
    inertia = {ratio: SHIPPED[f"fha-{size}-{ratio}"].get("armature", 0.0) for ratio in (50, 100, 160)}
    assert inertia[100] / inertia[50] == pytest.approx(4.0, rel=0.15)
    assert inertia[160] / inertia[100] == pytest.approx(2.56, rel=0.1)


def test_a_name_that_no_motor_has_gets_the_nearest_one():
    assert motor_type_named("xm430w350", SHIPPED) is None
    remedy = likely_motor_types("xm430w350", SHIPPED)
    assert "Did you mean xm430-w350?" in remedy and "motors.toml" in remedy


def test_a_users_table_adds_motors_and_replaces_shipped_ones(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CONFIG", str(tmp_path))
    (tmp_path / "motors.toml").write_text(
        "[own]\nposition_gain = 3\nlinear = true\nno_load_speed = 0.2\n"
        '[sg90]\nmax_torque = 0.1\nsources = {max_torque = "measured"}\n'
    )
    known = motor_types()
    assert known["own"].values == {"position_gain": 3.0, "no_load_speed": 0.2} and known["own"].linear
    assert known["own"].sources["position_gain"] == "the user" and known["own"].unit("no_load_speed") == "m/s"
    assert known["sg90"].values == {"max_torque": 0.1} and known["sg90"].sources == {"max_torque": "measured"}
    assert len(known) == len(SHIPPED) + 1


@pytest.mark.parametrize(
    ("text", "attribute", "what"),
    [
        ("own = 3", "own", "must be a table"),
        ("[own]\nmax_torqe = 3", "own.max_torqe", "Did you mean max_torque"),
        ("[own]\nmax_torque = 0", "own.max_torque", r"a positive number \[N m\]"),
        ("[own]\nmax_torque = true", "own.max_torque", "a positive number"),
        ("[own]\nfriction = -1", "own.friction", "not negative"),
        ("[own]\nfriction = inf", "own.friction", "not negative"),
        ("[own]\ntorque_speed_knee = 1.0", "own.torque_speed_knee", "below 1"),
        ("[own]\nlinear = 1", "own.linear", "true or false"),
        ("[own]\ntitle = 1", "own.title", "must be a text"),
        ("[own]\naliases = 'x'", "own.aliases", "list of texts"),
        ("[own]\nsources = {delay = 'x'}", "own.sources.delay", "not there"),
        ("[own]\ndelay = 1\nsources = {delay = 1}", "own.sources", "table of texts"),
    ],
)
def test_a_table_that_is_wrong_is_refused_with_file_name_and_value(tmp_path, text, attribute, what):
    file = tmp_path / "wrong.toml"
    file.write_text(text)
    with pytest.raises(ShotError, match=what) as caught:
        read_motor_types(file)
    assert (caught.value.path, caught.value.attribute) == (str(file), attribute)
    file.write_text("[")
    with pytest.raises(ShotError, match="cannot be read"):
        read_motor_types(file)


def test_all_quantities_but_shares_have_units_in_si():
    shares = {name for name, quantity in QUANTITIES.items() if not quantity.si}
    assert shares == {name for name in QUANTITIES if "load" in name or "exponent" in name or "knee" in name} - {
        "no_load_speed"
    }
