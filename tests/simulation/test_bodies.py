"""Reduced bodies of a character."""

from functools import partial

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.multibody.model.model import body_anchors
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction import reduce as finite_elements
from calmotion.reduction.full_models import FullModels
from calmotion.simulation.bodies import full_model_of, reduce_bodies
from calmotion.simulation.body_reduction import load_envelopes
from calmotion.testing import beam_arm, fresh_cache, quintic, shot_of


def reduced(arm, animation, meshes, tolerance, full=None):
    loads = load_envelopes(arm, animation, meshes, RunSettings())
    with fresh_cache():
        return reduce_bodies(arm, span_tree(arm), meshes, None, loads, tolerance, full)


@pytest.fixture
def made(monkeypatch):
    """The bodies whose full model is made."""
    paths, own = [], finite_elements.full_body

    def counted(mesh, body, *rest):
        paths.append(body.path)
        return own(mesh, body, *rest)

    monkeypatch.setattr(finite_elements, "full_body", counted)
    return paths


def assert_equal(bodies, others):
    for one, other in zip(bodies, others, strict=True):
        np.testing.assert_array_equal(one.stiffness, other.stiffness)
        np.testing.assert_array_equal(one.damping, other.damping)
        for marker, same in zip(one.markers, other.markers, strict=True):
            np.testing.assert_array_equal(marker.Phi, same.Phi)


def test_full_models_that_are_known_change_nothing(arm, animation, meshes, made):
    full = FullModels(keeps=True)
    first, again = (reduced(arm, animation, meshes, tolerance, full) for tolerance in (1e-3, 1e-4))
    assert sorted(made) == sorted({arm.bodies[mesh.body].path for mesh in meshes.meshes}), "each is made once"
    for found, tolerance in ((first, 1e-3), (again, 1e-4)):
        assert_equal(found, reduced(arm, animation, meshes, tolerance))


def test_links_that_are_alike_have_one_full_model_and_what_each_has_alone(made):
    """The links of a chain are equal and bear ever smaller loads; the last one holds its load at another angle."""
    character, meshes = beam_arm(3, cells=6)
    animation = shot_of(quintic(0.5, 0.5), 0.5, motors=3)
    loads = load_envelopes(character, animation, meshes, RunSettings())
    with fresh_cache():
        found = reduce_bodies(character, span_tree(character), meshes, None, loads, 1e-4)
    assert len(made) == 2 and "/Arm/Link2" in made, made
    assert len(found[0].stiffness) > len(found[2].stiffness) > 0, "loads differ"
    anchors = body_anchors(character, span_tree(character))
    for index in (0, 1, 2):
        own = full_model_of(character, meshes.meshes[index], anchors[index])
        alone = finite_elements.reduce_body(own.mesh, own.body, own.attachments, (), own.root, loads[index], 1e-4 / 3)
        equal = partial(np.testing.assert_allclose, rtol=1e-6, atol=1e-9)  # sums depend on the number of threads
        equal(alone.stiffness, found[index].stiffness)
        equal(alone.markers[0].Phi, found[index].markers[0].Phi)
