"""A body on a finer mesh begun from the coarser one, against factors and Lanczos' method from the start."""

import numpy as np
import pytest
from calmotion.mesh.bisection import bisected
from calmotion.reduction.basis import nested_interface_modes
from calmotion.reduction.basis.fixed_interface import FixedInterface
from calmotion.reduction.basis.natural_modes import lowest_modes
from calmotion.reduction.basis.nested_interface_modes import improved
from calmotion.reduction.elements.assembly import assemble

LENGTH, LIMIT = 0.3, 1e3


def held(points, tets, plastic, coarser=None):
    model = assemble(points, tets, plastic)
    x = model.mesh.nodes[:, 0]
    tip = np.flatnonzero(x > LENGTH - 1e-9)
    return FixedInterface.of(model, np.flatnonzero(x < 1e-9), [tip], [np.array([LENGTH, 0.03, 0.025])], coarser=coarser)


@pytest.fixture(scope="module")
def bar(helpers):
    return helpers.box((6, 1, 1), (LENGTH, 0.06, 0.05))


@pytest.fixture(scope="module")
def finer(bar):
    points, tets = bar
    near = np.flatnonzero(points[tets][:, :, 0].min(axis=1) < 0.1)
    return bisected(points, tets, near)


def test_modes_of_a_finer_mesh_are_those_of_lanczos(bar, finer, plastic):
    coarse = held(*bar, plastic)
    coarse.all_needed(LIMIT, np.ones(12))
    exact = held(*finer, plastic)._up_to((4.0 * np.pi * LIMIT) ** 2)
    fine = held(*finer, plastic, coarse.for_finer())
    values, vectors = fine._up_to((4.0 * np.pi * LIMIT) ** 2)
    before = coarse._up_to((4.0 * np.pi * LIMIT) ** 2)[0]
    assert len(values) == len(exact[0]) and np.abs(before / exact[0] - 1.0).max() > 0.01
    assert values[:4] == pytest.approx(exact[0][:4], rel=1e-4) and (values >= exact[0] * (1.0 - 1e-9)).all()
    assert (values - exact[0] < 0.1 * np.abs(before - exact[0])).all()
    assert vectors.T @ (fine.M @ vectors) == pytest.approx(np.eye(len(values)), abs=1e-9)


def test_a_mesh_that_is_not_bisected_from_the_coarser_one_begins_anew(bar, helpers, plastic):
    coarse = held(*bar, plastic)
    coarse.all_needed(LIMIT, np.ones(12))
    other = helpers.box((7, 2, 1), (LENGTH, 0.06, 0.05))
    begun, exact = held(*other, plastic, coarse.for_finer()), held(*other, plastic)
    assert np.array_equal(begun.all_needed(LIMIT, np.ones(12)), exact.all_needed(LIMIT, np.ones(12)))


def test_a_limit_that_was_not_asked_for_begins_anew(bar, finer, plastic):
    coarse, exact = held(*bar, plastic), held(*finer, plastic)
    coarse.all_needed(LIMIT, np.ones(12))
    fine = held(*finer, plastic, coarse.for_finer())
    assert np.array_equal(fine.all_needed(3.0 * LIMIT, np.ones(12)), exact.all_needed(3.0 * LIMIT, np.ones(12)))


def test_a_step_from_modes_leaves_them(bar, plastic):
    body = held(*bar, plastic)
    values, vectors = lowest_modes(body.K, body.M, 6, solver=body.solver)
    found, same = improved(body.K, body.M, body.solver, values, vectors)
    assert found == pytest.approx(values, rel=1e-9)
    assert np.abs(vectors.T @ (body.M @ same)) == pytest.approx(np.eye(6), abs=1e-6)


def test_large_meshes_have_no_factors_and_the_same_responses(bar, plastic, monkeypatch):
    monkeypatch.setattr(nested_interface_modes, "_FACTORISED", 0)
    points, tets = bar
    body = held(points, tets, plastic)
    for _ in range(3):
        body.all_needed(LIMIT, np.ones(12))
        near = np.flatnonzero(points[tets][:, :, 0].min(axis=1) < 0.1)
        points, tets = bisected(points, tets, near)
        body = held(points, tets, plastic, body.for_finer())
    exact = held(points, tets, plastic)
    assert body.solver.entries == 0 < exact.solver.entries
    assert np.abs(body.patch_stiffness() - exact.patch_stiffness()).max() < 1e-5 * np.abs(exact.patch_stiffness()).max()
    for found, right in zip(body.inertial(), exact.inertial(), strict=True):
        off = found - right
        assert (np.einsum("ij,ij->j", off, exact.K @ off) <= 1e-4 * np.einsum("ij,ij->j", right, exact.K @ right)).all()
    values, expected = (each._up_to((4.0 * np.pi * LIMIT) ** 2)[0] for each in (body, exact))
    assert values[:4] == pytest.approx(expected[:4], rel=1e-4)
