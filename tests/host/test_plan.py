"""The shared `register` and `unregister`, and the form of operators."""

import itertools

import pytest
from calmotion.host import PlanError, PluginError, registration
from calmotion.host.operators import check_operator
from calmotion.host.plan import make_plan
from fakes import Coal, Iron, Ore, Steel, operator

DIG = operator("mine.dig", provides=[Ore])
MELT = operator("smithy.melt", requires=[Ore], provides=[Iron])
BURN = operator("wood.burn", provides=[Coal])
ALLOY = operator("smithy.alloy", requires=[Iron], uses=[Coal], provides=[Steel])


def names(plan):
    return [cls.idname for cls in plan.operators]


def test_providers_come_before_those_that_need_them_in_whatever_order_they_registered():
    for order in itertools.permutations([DIG, MELT, BURN, ALLOY]):
        planned = names(make_plan(order, [], [Steel]))
        assert planned.index("mine.dig") < planned.index("smithy.melt") < planned.index("smithy.alloy")
        assert planned.index("wood.burn") < planned.index("smithy.alloy")


def test_only_what_is_needed_is_planned():
    assert names(make_plan([DIG, MELT, BURN, ALLOY], [], [Iron])) == ["mine.dig", "smithy.melt"]


def test_what_is_given_is_not_made():
    assert names(make_plan([DIG, MELT], [Ore], [Iron])) == ["smithy.melt"]


def test_a_used_type_without_a_provider_is_no_obstacle():
    assert names(make_plan([DIG, MELT, ALLOY], [], [Steel])) == ["mine.dig", "smithy.melt", "smithy.alloy"]


def test_an_optional_type_that_cannot_be_made_is_not_planned_for():
    assert names(make_plan([DIG, ALLOY], [], [Ore], [Steel])) == ["mine.dig"]


def test_a_missing_type_is_named_with_who_needs_it_and_the_plugins_that_failed():
    with pytest.raises(PlanError) as missing:
        make_plan([MELT, ALLOY], [], [Steel], broken=["mine (no shovel)"])
    assert "no operator provides Ore, which smithy.melt needs" in str(missing.value)
    assert "mine (no shovel)" in str(missing.value)


def test_a_circle_is_named():
    back = operator("smithy.scrap", requires=[Steel], provides=[Ore])
    with pytest.raises(PlanError) as circle:
        make_plan([MELT, ALLOY, back], [], [Steel])
    assert all(name in circle.value.found for name in ("smithy.melt", "smithy.alloy", "smithy.scrap"))


def test_a_circle_of_operators_that_is_not_needed_is_ignored():
    one = operator("a.one", requires=[Steel], provides=[Coal])
    two = operator("a.two", requires=[Coal], provides=[Steel])
    assert names(make_plan([DIG, one, two], [], [Ore])) == ["mine.dig"]


class Calls:
    """A host that notes what it is asked to do."""

    def __init__(self):
        self.made = []

    def register_operator(self, cls):
        self.made.append(("add", cls))

    def unregister_operator(self, cls):
        self.made.append(("remove", cls))


def test_operators_are_added_in_order_and_removed_in_reverse():
    register, unregister = registration(int, str)
    host = Calls()
    register(host)
    unregister(host)
    assert host.made == [("add", int), ("add", str), ("remove", str), ("remove", int)]


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"checks": [Coal], "check": print}, "neither requires nor uses"),
        ({"checks": [Ore]}, "belong together"),
        ({"check": print}, "belong together"),
        ({"checks": [Ore, Ore], "check": print}, "names a type twice"),
    ],
)
def test_checks_and_check_must_fit(changes, problem):
    with pytest.raises(PluginError, match=problem):
        check_operator(operator("smithy.melt", requires=[Ore], provides=[Iron], **changes))


def test_a_check_of_declared_types_is_well_formed():
    check_operator(operator("smithy.melt", requires=[Ore], uses=[Coal], provides=[Iron], checks=[Coal], check=print))
