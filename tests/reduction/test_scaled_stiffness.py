"""A body of scaled stiffness is the body of a material that is scaled likewise, for every elastic law."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.mesh.tetrahedra import measure_quality
from calmotion.model import Body, FEMesh, FlexibleSettings
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.reduce import reduce_body
from calmotion.reduction.scaled_stiffness import with_graded_stiffness, with_scaled_stiffness, with_scaled_strain


@pytest.mark.parametrize("law", ["linear", "stvk", "neohookean"])
def test_the_stiffness_is_that_of_another_material(helpers, plastic, law):
    points, tets = helpers.box((6, 1, 1), (0.3, 0.04, 0.04))
    points = np.asarray(points) - [0.0, 0.02, 0.02]
    mesh = FEMesh(0, points, tets, measure_quality(points, tets))
    frames = [
        AttachmentFrame("/Arm/tip", helpers.frame(0.3, 0.0, 0.0), "interface"),
        AttachmentFrame("/Arm/root", helpers.frame(0.0, 0.0, 0.0), "interface"),
    ]
    plastic = replace(plastic, rayleigh=(0.1, 1e-4))
    settings = FlexibleSettings(plastic, interface_radius=0.03, elasticity=law, mode_count=6)
    softer = replace(settings, material=replace(plastic, youngs_modulus=0.9 * plastic.youngs_modulus))
    none, force = np.zeros(3), np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 0.0]])
    loads = LoadEnvelope(none, none, none, force, np.zeros((2, 3)))
    bodies = [Body("/Arm/link", helpers.frame(0, 0, 0), None, flexible=own) for own in (settings, softer)]
    body, other = (reduce_body(mesh, own, frames, [], 1, loads) for own in bodies)
    scaled = with_scaled_stiffness(body, 0.9)
    r = len(body.stiffness)
    count = 6  # modal derivatives of degenerate modes may come in another order
    assert scaled.stiffness == pytest.approx(0.9 * body.stiffness)
    assert scaled.stiffness[:count] == pytest.approx(other.stiffness[:count], rel=1e-5)
    if law == "linear":
        assert scaled.elasticity is None
    elif law == "stvk":
        assert np.array_equal(scaled.elasticity.data, 0.9 * body.elasticity.data)
    else:
        assert scaled.elasticity.lame == pytest.approx(other.elasticity.lame)
        assert np.array_equal(scaled.elasticity.data[: r * r], 0.9 * body.elasticity.data[: r * r])
        assert np.array_equal(scaled.elasticity.data[r * r :], body.elasticity.data[r * r :])
    check_grading(body)
    check_strain(body)


def check_grading(body):
    """The linear part of the law is the stiffness, also where that grows with the frequency."""
    graded = with_graded_stiffness(body, 0.1)
    ratio = body.frequencies / body.frequencies.min()
    assert graded.stiffness == pytest.approx(body.stiffness * ratio**0.1)
    assert with_graded_stiffness(body, 0.0) is body
    if body.elasticity is None:
        return
    r, law, before = len(body.stiffness), graded.elasticity, body.elasticity
    if before.law == "stvk":
        size = round(np.sqrt(len(law.data)))
        gram = law.data.reshape(size, size)
        assert np.diag(gram)[:r] == pytest.approx(np.diag(before.data.reshape(size, size))[:r] * ratio**0.1)
        assert np.array_equal(gram[r:, r:], before.data.reshape(size, size)[r:, r:])
        assert np.linalg.eigvalsh(gram).min() > -1e-9 * np.abs(gram).max()
    else:
        change = (law.data - before.data)[: r * r].reshape(r, r)
        assert change == pytest.approx(np.diag(graded.stiffness - body.stiffness), abs=1e-9 * body.stiffness.max())


def check_strain(body):
    """The quadratic part of the strain alone is scaled, so the energy of small deflections stays."""
    scaled, law = with_scaled_strain(body, 0.9), body.elasticity
    if law is None or law.law != "stvk":
        assert scaled is body
        return
    assert with_scaled_strain(body, 1.0) is body and scaled.stiffness is body.stiffness
    size, r = round(np.sqrt(len(law.data))), len(body.stiffness)
    before, after = (one.elasticity.data.reshape(size, size) for one in (body, scaled))
    assert np.array_equal(after[:r, :r], before[:r, :r])
    assert after[:r, r:] == pytest.approx(0.9 * before[:r, r:]) and after[r:, r:] == pytest.approx(
        0.81 * before[r:, r:]
    )
