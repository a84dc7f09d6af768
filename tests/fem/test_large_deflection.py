"""The reduced law of a body of large deflection."""

import numpy as np
import pytest
from boxes import box_tets, fe_mesh
from calmotion.fem.interfaces import Anchor
from calmotion.fem.large_deflection import PAIRED_MODES, rayleigh_coefficients
from calmotion.fem.reduce import reduce_body
from calmotion.shot import Body, ElasticMaterial, FlexibleSettings, Frame

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def arm(law, material):
    points, tets = box_tets((12, 1, 1), (0.6, 0.02, 0.02), (0.0, -0.01, -0.01))
    body = Body(
        "/C/Arm", Frame(np.zeros(3), IDENTITY), None, flexible=FlexibleSettings(material, mode_count=6, elasticity=law)
    )
    anchors = [
        Anchor("/C/J", Frame(np.zeros(3), IDENTITY), "interface"),
        Anchor("/C/W", Frame(np.array([0.6, 0.0, 0.0]), IDENTITY), "interface"),
    ]
    return reduce_body(fe_mesh(points, tets), body, anchors, (), 0)


def test_a_linear_body_has_no_law(plastic):
    assert arm("linear", plastic).elasticity is None


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_a_nonlinear_body_has_more_modes_and_damping_by_mass_alone(plastic, law):
    linear, body = arm("linear", plastic), arm(law, plastic)
    assert body.elasticity is not None and body.elasticity.law == law
    assert len(body.stiffness) > len(linear.stiffness) == 6
    assert np.allclose(body.frequencies[:4], linear.frequencies[:4], rtol=1e-3)
    assert np.ptp(body.damping) == 0.0 and body.damping[0] > 0.0
    r = len(body.stiffness)
    if law == "stvk":
        gram = body.elasticity.data.reshape(r + r * (r + 1) // 2, -1)
        assert np.allclose(np.diag(gram)[:r], body.stiffness, rtol=1e-6)
    else:
        assert body.elasticity.data.size == r * r + body.elasticity.points * (1 + 9 * r)


def test_a_ratio_of_damping_is_met_at_the_first_and_last_paired_mode():
    material = ElasticMaterial("/M", 1e9, 0.3, 1e3, damping_ratio=0.02)
    omega = np.array([10.0, 11.0, 60.0, 65.0, 90.0, 170.0, 300.0, 400.0])
    mass, stiffness = rayleigh_coefficients(omega**2, material)
    ratio = 0.5 * (mass / omega + stiffness * omega)
    assert ratio[0] == pytest.approx(0.02) and ratio[PAIRED_MODES - 1] == pytest.approx(0.02)
    assert (ratio[1 : PAIRED_MODES - 1] < 0.02).all() and (ratio[PAIRED_MODES:] > 0.02).all()


def test_rayleigh_coefficients_are_taken_as_authored():
    material = ElasticMaterial("/M", 1e9, 0.3, 1e3, rayleigh=(0.3, 1e-4))
    assert rayleigh_coefficients(np.array([1.0]), material) == (0.3, 1e-4)
    assert rayleigh_coefficients(np.zeros(0), ElasticMaterial("/M", 1e9, 0.3, 1e3)) == (0.0, 0.0)
