"""The table of materials, and the user's own."""

import pytest
from calmotion.catalogs.materials import GROUPS, MATERIALS, material_named, materials, read_materials
from calmotion.errors import ShotError


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_is_plausible_and_has_its_source(name):
    material = MATERIALS[name]
    stiff = {"plastic": (0.1e9, 10e9), "metal": (30e9, 300e9), "composite": (5e9, 300e9)}[material.group]
    assert stiff[0] < material.youngs_modulus < stiff[1] and 0.2 < material.poissons_ratio < 0.47
    assert 800.0 < material.density < 9000.0 and 1e-3 < material.damping_ratio < 0.05
    assert len(material.source) > 20 and material.title and material.group in GROUPS


def test_names_and_other_names_are_distinct():
    names = [*MATERIALS, *(alias for material in MATERIALS.values() for alias in material.aliases)]
    assert len(set(names)) == len(names) and all(name == name.lower() for name in names)


def test_a_material_is_found_by_its_other_names_and_a_wrong_one_gets_the_nearest():
    assert material_named("Carbon-Fibre", MATERIALS)[0] == material_named("CFRP", MATERIALS)[0] == "carbon_fibre"
    with pytest.raises(ShotError) as refused:
        material_named("polycarbonat", MATERIALS)
    assert "Did you mean polycarbonate?" in refused.value.remedy


OWN = '[abs]\nyoungs_modulus = 1.9\npoissons_ratio = 0.36\ndensity = 980\ndamping_ratio = 0.03\nsource = "a test"\n'


def test_materials_of_the_user_are_added_and_replace_others(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(OWN + OWN.replace("abs", "balsa"))
    found = materials([file])
    assert found["abs"].youngs_modulus == 1.9e9 and found["balsa"].density == 980.0
    assert found["abs"].source == "a test" and found["pla"] == MATERIALS["pla"]
    assert MATERIALS["abs"].youngs_modulus == 2.1e9, "the shipped table stays"


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("[abs", "cannot be read"), ("abs = 3", "must be a table"), (OWN + "colour = 1", "abs.colour"),
        (OWN.replace("1.9", "1.9e9"), "youngs_modulus"), (OWN.replace("0.36", "0.5"), "poissons_ratio"),
        (OWN.replace("density = 980\n", ""), "density"), (OWN.replace('"a test"', "3"), "source"),
    ],
)  # fmt: skip
def test_a_wrong_material_is_refused_with_its_place(tmp_path, text, place):
    file = tmp_path / "own.toml"
    file.write_text(text)
    with pytest.raises(ShotError) as refused:
        read_materials(file)
    assert place in refused.value.message() and "own.toml" in refused.value.message() and refused.value.remedy
