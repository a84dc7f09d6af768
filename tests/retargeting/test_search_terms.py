"""Terms of plugins that are wrong are refused with their own names, before the search."""

from dataclasses import dataclass

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model.run import RunSettings
from calmotion.retargeting import AddedLimit, AddedResidual, Efforts, FunctionOf
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.search_terms import refuse_terms
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.testing import small_shot
from scipy.sparse import eye


@dataclass(frozen=True)
class Strength(AddedLimit):
    """Efforts within a bound."""

    largest: float = 5.0

    def quantity(self, character, model, grid):
        return Efforts(model)

    def bounds(self, character):
        return -self.largest, self.largest


class Effort(Strength):
    name = "effort"


class Feet(Strength):
    name = "ground"


class Named(Strength):
    name = "strength"


class Weighted(AddedResidual):
    name = "efforts"

    def quantity(self, character, model, grid):
        return FunctionOf(Efforts(model), lambda values: (values, eye(3, format="csr")))

    def weight(self, times):
        return 1.0


class Unweighted(Weighted):
    def quantity(self, character, model, grid):
        return Efforts(model)

    def weight(self, times):
        return self.size


@pytest.mark.parametrize(
    ("term", "said"), [(Effort(), "the name of a limit"), (Feet(), "the name of a limit"), (Strength(), "has no name")]
)
def test_a_term_does_not_take_the_place_of_a_limit_of_the_motors(term, said):
    character, _ = small_shot()
    with pytest.raises(ShotError, match=said) as error:
        refuse_terms(RunSettings(terms=(term,)), character)
    assert type(term).__qualname__ in error.value.attribute
    refuse_terms(RunSettings(terms=(Named(),)), character)


@pytest.mark.parametrize(
    ("term", "said"),
    [
        (Weighted(), "derivatives have shape"),
        (Unweighted(), "AttributeError: 'Unweighted' object has no attribute 'size'"),
        (Named(np.inf), "no bound is finite"),
    ],
)
def test_what_is_wrong_with_a_term_is_told_as_its_own(term, said):
    shot = compile_shot(*small_shot())
    with pytest.raises(ShotError, match="term '(efforts|strength)' of a plugin failed") as error:
        optimize_shot(shot, RunSettings(step=0.01, terms=(term,)), lambda fraction, message: None)
    assert said in str(error.value.found) and type(term).__qualname__ in error.value.attribute
