"""Skin and infill of printed bodies, as the shot states them."""

import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import Sdf
from small_shots import FORE, Scale, make_flexible, set_float, write_arm


def fore(tmp_path, edit, scale=None):
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit, scale)))
    return next(b for b in character.bodies if b.path == FORE), character.notes


def printed(infill=None, perimeters=None, wall=None, section=None, scale=None):
    def edit(stage):
        make_flexible(stage, scale=scale or Scale())
        if infill is not None:
            set_float(stage, FORE, "calm:flexible:infill", infill)
        if wall is not None:
            set_float(stage, FORE, "calm:flexible:wallThickness", wall)
        if perimeters is not None:
            stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:perimeters", Sdf.ValueTypeNames.Int).Set(
                perimeters
            )
        if section is not None:
            stage.GetPrimAtPath(FORE).CreateAttribute("calm:flexible:section", Sdf.ValueTypeNames.Token).Set(section)

    return edit


def test_infill_makes_a_core_below_a_skin_of_two_lines(tmp_path):
    body, notes = fore(tmp_path, printed(infill=0.2))
    core = body.flexible.material.core
    assert (core.skin, core.infill) == pytest.approx((0.9e-3, 0.2)) and core.stiffness == pytest.approx(0.2 / 2.6)
    assert body.flexible.wall_thickness == -1.0
    assert any("0.9 mm and 20% infill" in note for note in notes)
    assert fore(tmp_path, make_flexible)[0].flexible.material.core is None


def test_perimeters_or_a_wall_tell_the_skin(tmp_path):
    assert fore(tmp_path, printed(infill=0.2, perimeters=4))[0].flexible.material.core.skin == pytest.approx(1.8e-3)
    scale = Scale(meters=0.01)
    body = fore(tmp_path, printed(infill=0.2, wall=0.12, scale=scale), scale)[0]
    assert body.flexible.material.core.skin == pytest.approx(1.2e-3) and body.flexible.wall_thickness == -1.0


def test_no_infill_is_a_hollow_part_and_all_of_it_a_solid_one(tmp_path):
    hollow = fore(tmp_path, printed(infill=0.0, perimeters=3))[0].flexible
    assert hollow.material.core is None and hollow.wall_thickness == pytest.approx(1.35e-3)
    solid = fore(tmp_path, printed(infill=1.0, perimeters=3))[0].flexible
    assert solid.material.core is None and solid.wall_thickness == -1.0


@pytest.mark.parametrize(
    ("given", "attribute", "text"),
    [
        ({"infill": 20.0}, "infill", "0.2 for 20%"),
        ({"infill": -0.5}, "infill", "between 0 and 1"),
        ({"infill": float("nan")}, "infill", "between 0 and 1"),
        ({"infill": 0.2, "perimeters": 0}, "perimeters", "at least 1"),
        ({"perimeters": 3}, "perimeters", "no infill"),
        ({"infill": 0.2, "perimeters": 3, "wall": 0.002}, "perimeters", "Remove one"),
        ({"infill": 0.2, "section": "tube"}, "section", "infill to 0"),
    ],
)
def test_contradictions_are_refused_with_what_to_do(tmp_path, given, attribute, text):
    with pytest.raises(ShotError, match=text) as caught:
        fore(tmp_path, printed(**given))
    assert (caught.value.path, caught.value.attribute) == (FORE, f"calm:flexible:{attribute}")
