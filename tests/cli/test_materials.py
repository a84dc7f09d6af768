"""`calmotion materials`."""

import json
import tomllib

from calmotion.catalogs.materials import MATERIALS


def test_materials_are_listed_with_their_sources(calmotion):
    assert all(name in calmotion("materials").stdout for name in MATERIALS)
    one = calmotion("materials", "cfrp")
    assert "carbon_fibre" in one.stdout and "CUED" in one.stdout and "abs" not in one.stdout
    assert json.loads(calmotion("materials", "--json").stdout)["materials"]["abs"]["youngs_modulus"] == 2.1e9
    assert calmotion("materials", "unobtainium").returncode == 1


def test_the_toml_of_a_material_is_read_again(calmotion, tmp_path, monkeypatch):
    text = calmotion("materials", "abs", "--toml").stdout
    assert tomllib.loads(text)["abs"]["youngs_modulus"] == 2.1
    (tmp_path / "own.toml").write_text(text.replace("[abs]", "[mine]").replace("2.1", "2.6"))
    assert "2.6" in calmotion("materials", "mine", "--materials", tmp_path / "own.toml").stdout
    monkeypatch.setenv("CALMOTION_CONFIG", str(tmp_path))
    (tmp_path / "own.toml").rename(tmp_path / "materials.toml")
    assert "2.6" in calmotion("materials", "mine").stdout, "that of the configuration folder"
