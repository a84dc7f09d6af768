import pytest
from calmotion.host import PluginError, Property, SettingError
from calmotion.host.properties import values_of

SIZE = Property("size", float, -1.0, unit="m", minimum=1e-6, maximum=10.0, description="Edge length.")
COUNT = Property("count", int, 3, minimum=1)
FAST = Property("fast", bool, False)
KIND = Property("kind", str, "a", choices=("a", "b"))


def test_text_and_typed_values_become_the_declared_type():
    values = values_of([SIZE, COUNT, FAST, KIND], {"size": "5mm", "count": 7, "fast": "yes", "kind": "b"}, "fe.mesh")
    assert (values.size, values.count, values.fast, values.kind) == (0.005, 7, True, "b")
    assert isinstance(values.count, int)


def test_the_default_is_allowed_outside_the_range():
    assert values_of([SIZE], {"size": "-1"}, "fe.mesh").size == -1.0


@pytest.mark.parametrize(
    ("declared", "value"),
    [
        (SIZE, "-2"),
        (SIZE, "11m"),
        (SIZE, "5"),
        (SIZE, "0.005"),
        (SIZE, 0),
        (COUNT, "2.5"),
        (COUNT, True),
        (FAST, "maybe"),
        (FAST, 1),
        (KIND, "c"),
    ],
)
def test_a_wrong_value_is_refused_and_the_property_named(declared, value):
    with pytest.raises(SettingError) as refused:
        values_of([declared], {declared.name: value}, "fe.mesh")
    assert refused.value.path == f"fe.mesh.{declared.name}"
    assert refused.value.remedy


def test_an_unknown_property_is_refused_with_the_known_ones():
    with pytest.raises(SettingError, match="It has: size, count"):
        values_of([SIZE, COUNT], {"sise": 1.0}, "fe.mesh")


@pytest.mark.parametrize(
    "wrong",
    [
        Property("a b", float, 1.0),
        Property("size", list, []),
        Property("size", float, "1"),
        Property("size", float, 1.0, unit="furlong"),
        Property("name", str, "x", unit="m"),
        Property("count", int, 1.5),
    ],
)
def test_a_declaration_that_cannot_be_right_is_refused(wrong):
    with pytest.raises(PluginError):
        wrong.check()


@pytest.mark.parametrize(
    ("declared", "value", "near"),
    [
        (SIZE, "11m", "10 m"),
        (SIZE, "5", "5m or 5mm"),
        (SIZE, "-2", "1e-06 m"),
        (COUNT, 0, "1"),
        (Property("kind", str, "linear", choices=("linear", "stvk")), "linaer", "linear"),
    ],
)
def test_the_nearest_right_value_is_named(declared, value, near):
    with pytest.raises(SettingError) as refused:
        values_of([declared], {declared.name: value}, "fe.mesh")
    assert near in refused.value.remedy.split(". ")[0] + refused.value.remedy.split("? ")[0]


def test_an_optional_number_is_left_to_the_operator_unless_it_is_given():
    spacing = Property("spacing", float, None, unit="s", minimum=0.0)
    spacing.check()
    for given in ({}, {"spacing": "auto"}, {"spacing": -1.0}, {"spacing": None}):
        assert values_of([spacing], given, "x").spacing is None
    assert values_of([spacing], {"spacing": "20ms"}, "x").spacing == pytest.approx(0.02)
    with pytest.raises(SettingError, match="out of range"):
        values_of([spacing], {"spacing": "-2"}, "x")
    with pytest.raises(PluginError, match="no default"):
        Property("kind", str, None).check()
