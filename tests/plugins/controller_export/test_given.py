"""What no controller or shot has is refused before commands are written."""

import pytest
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion_plugins.controller_export import export
from calmotion_plugins.controller_export.given import given_export
from one_hinge import ONE_HINGE


@pytest.mark.parametrize("rate", [0.0, -1.0, 0.5, 1e6, float("nan"), float("inf")])
def test_a_rate_that_no_controller_has_is_refused(rate):
    with pytest.raises(SettingError, match="the rate must be 1 to 100000"):
        given_export("csv", rate, 0.0, None)


def test_an_allowed_loss_of_nothing_is_refused():
    with pytest.raises(SettingError, match="the allowed loss must be positive"):
        given_export("csv", 100, allowed_loss="0mm")


def test_texts_are_in_their_units():
    given = given_export("csv", 100, "5ms", "1mm")
    assert (given.rate, given.delay, given.tolerance) == (100.0, 0.005, 0.001)


@pytest.mark.parametrize(
    ("options", "place"),
    [
        ({"start_delay": 2.0}, "--start-delay"),
        ({"start_delay": 1e9}, "--start-delay"),
        ({"tolerance": 0.0}, "--tolerance"),
        ({"tolerance": "1m"}, "--tolerance"),
        ({"tolerance": 1e-15}, "--tolerance"),
    ],
)
def test_what_does_not_fit_the_shot_is_refused_and_nothing_is_written(tmp_path, options, place):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    with pytest.raises(ShotError) as error:
        export(tmp_path / "shot.usda", tmp_path / "commands.csv", to="csv", **options)
    assert error.value.attribute == place and error.value.remedy
    assert [path.name for path in tmp_path.iterdir()] == ["shot.usda"]
