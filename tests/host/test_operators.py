"""The shared `register` and `unregister`, and the form of operators."""

import pytest
from calmotion.host import PluginError, registration
from calmotion.host.operators import check_operator
from fakes import Coal, Iron, Ore, operator


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
