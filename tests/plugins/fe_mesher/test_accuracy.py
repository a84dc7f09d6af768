"""The size of elements that accuracy needs: estimated, compared, and told where it is missed."""

from dataclasses import replace

import numpy as np
import pytest
from mesher_links import box, link, run, surface


def test_the_size_that_accuracy_needs_is_found_once_and_kept(host, package, own_cache, monkeypatch):
    body = link(surface(box((0.2, 0.02, 0.02))))
    (first,) = run(host, body)
    assert len(list(own_cache.iterdir())) == 2  # the mesh, and what was found out about it
    for module, name in (("tetwild", "_run"), ("body_mesh", "estimate")):
        monkeypatch.setattr(package(module), name, lambda *arguments: pytest.fail("worked again"))
    (again,) = run(host, body)
    assert np.array_equal(first.tets, again.tets) and first.quality.repairs == again.quality.repairs
    assert 0.0 < first.quality.frequency_error == again.quality.frequency_error < 0.05


def test_a_mesh_that_is_too_coarse_is_refined_and_the_remaining_error_is_reported(host, package, monkeypatch):
    accuracy, body_mesh = package("accuracy"), package("body_mesh")
    estimates = iter([accuracy.Accuracy(0.05, 1000, np.ones(3)), accuracy.Accuracy(0.03, 5000, np.ones(3) * 0.9)])
    monkeypatch.setattr(body_mesh, "estimate", lambda *arguments: next(estimates))
    sizes = []
    made = body_mesh.filled

    def filled(*arguments):
        sizes.append(arguments[4])
        return made(*arguments)

    monkeypatch.setattr(body_mesh, "filled", filled)
    (mesh,) = run(host, link(surface(box((0.2, 0.02, 0.02)))), cache=False)
    assert len(sizes) == 2 and sizes[1] == pytest.approx(0.5 * sizes[0])
    assert any("3% (5000 nodes)" in repair for repair in mesh.quality.repairs)
    assert mesh.quality.frequency_error == 0.03


def test_two_meshes_may_show_that_the_estimate_is_too_high_but_never_that_it_is_too_low(package):
    accuracy = package("accuracy")
    coarse = accuracy.Accuracy(0.05, 1000, np.array([10.2, 20.0, 30.0]))
    fine = accuracy.Accuracy(0.04, 8000, np.array([10.0, 20.0, 30.0]))
    # half the size: an error of order two is a third of the change; twice that is believed
    assert accuracy.compared(coarse, fine).error == pytest.approx(2.0 * 0.02 / 3.0)
    assert accuracy.compared(coarse, replace(fine, error=1e-3)).error == 1e-3
    assert accuracy.compared(replace(coarse, nodes=7500), fine).error == 0.04
