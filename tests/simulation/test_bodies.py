"""Reduced bodies of a character."""

import numpy as np
from calmotion.benchmarks.common.fresh_cache import fresh_cache
from calmotion.multibody.model.topology import span_tree
from calmotion.shot.run import RunSettings
from calmotion.simulation import bodies as module
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.body_reduction import load_envelopes


def reduced(arm, animation, meshes, tolerance, full=None):
    loads = load_envelopes(arm, animation, meshes, RunSettings())
    with fresh_cache():
        return reduce_bodies(arm, span_tree(arm), meshes, None, loads, tolerance, full)


def test_full_models_that_are_known_change_nothing(arm, animation, meshes):
    full = {}
    first = reduced(arm, animation, meshes, 1e-3, full)
    assert sorted(full) == [mesh.body for mesh in meshes.meshes]
    known = dict(full)
    again = reduced(arm, animation, meshes, 1e-4, full)
    assert full == known
    for found, tolerance in ((first, 1e-3), (again, 1e-4)):
        for one, other in zip(found, reduced(arm, animation, meshes, tolerance), strict=True):
            np.testing.assert_array_equal(one.stiffness, other.stiffness)
            np.testing.assert_array_equal(one.markers[-1].Phi, other.markers[-1].Phi)


def test_no_more_of_them_are_kept_than_fit(arm, animation, meshes, monkeypatch):
    full = {}
    reduced(arm, animation, meshes, 1e-3, full)
    entries = [item.entries for item in full.values()]
    monkeypatch.setattr(module, "_KEPT", sum(entries) - 1)
    few = {}
    reduced(arm, animation, meshes, 1e-3, few)
    assert 0 < len(few) < len(full)
