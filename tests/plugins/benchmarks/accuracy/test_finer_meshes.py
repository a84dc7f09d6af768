"""Meshes of references have as many more nodes as they should, and the same loads."""

import pytest
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.model.run import RunSettings
from calmotion.simulation.body_reduction import reduction_for
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion_plugins.benchmarks.accuracy.reference_bench import with_more_nodes


def nodes(reduction):
    return [len(quadratic_mesh(mesh.points, mesh.tets).nodes) for mesh in reduction.meshes.meshes]


@pytest.fixture(scope="module")
def reduction():
    character, meshes = beam_arm(cells=4, across=1)
    return reduction_for(character, shot_of(quintic(0.5, 0.4), 0.5), meshes, RunSettings())


def test_the_reference_has_so_many_times_the_nodes(reduction):
    finer = with_more_nodes(reduction, 4.0, stiffness=4_000)
    assert nodes(finer)[0] > 4.0 * nodes(reduction)[0] and finer.loads is reduction.loads
    assert finer.meshes.meshes[0].quality.frequency_error is not None


def test_its_stiffness_is_that_of_still_finer_meshes(reduction):
    own, finer = (with_more_nodes(reduction, 4.0, stiffness=most) for most in (1, 4_000))
    assert nodes(own) == nodes(finer)
    told = [each.meshes.meshes[0].quality for each in (own, finer)]
    assert told[1].frequency_error < 0.5 * told[0].frequency_error
    assert told[1].stiffness_factor < 1.0


def test_once_the_nodes_is_the_same(reduction):
    assert with_more_nodes(reduction, 1.0) is reduction
