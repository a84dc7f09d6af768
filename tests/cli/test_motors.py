"""`calmotion motors`."""

import json
import tomllib

from calmotion.catalogs.motor_types import motor_types


def test_motors_are_listed_and_one_is_shown_with_the_source_of_each_value(calmotion):
    assert all(name in calmotion("motors").stdout for name in motor_types())
    one = calmotion("motors", "XM430-W350-T").stdout
    assert "21.1 N m/rad" in one and "46 rev/min" in one and "Haarnoja" in one and "xm540" not in one
    told = json.loads(calmotion("motors", "mx-64", "--json").stdout)["motors"]["mx-64"]["values"]["armature"]
    assert told["value"] == 0.01124 and told["unit"] == "kg m^2" and "BAM" in told["source"]
    missing = calmotion("motors", "xm430-w35")
    assert missing.returncode == 1 and "xm430-w350" in missing.stderr


def test_the_toml_of_all_motors_is_read_again_as_it_was(calmotion, tmp_path):
    text = calmotion("motors", "--toml").stdout
    (tmp_path / "own.toml").write_text(text)
    again = json.loads(calmotion("motors", "--motors", tmp_path / "own.toml", "--json").stdout)["motors"]
    assert again == json.loads(calmotion("motors", "--json").stdout)["motors"]
    (tmp_path / "own.toml").write_text(text.replace("[mx-64]", "[mine]").replace("[mx-64.sources]", "[mine.sources]"))
    assert tomllib.loads(text)["mx-64"]["max_speed"] == 63.0
    assert "63 rev/min" in calmotion("motors", "mine", "--motors", tmp_path / "own.toml").stdout
