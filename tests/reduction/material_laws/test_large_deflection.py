"""The reduced law of a body of large deflection."""

import numpy as np
import pytest
from boxes import box_tets, fe_mesh
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.model import Body, FlexibleSettings, Frame
from calmotion.reduction.reduce import reduce_body

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def arm(law, material):
    points, tets = box_tets((12, 1, 1), (0.6, 0.02, 0.02), (0.0, -0.01, -0.01))
    body = Body(
        "/C/Arm", Frame(np.zeros(3), IDENTITY), None, flexible=FlexibleSettings(material, mode_count=6, elasticity=law)
    )
    attachments = [
        AttachmentFrame("/C/J", Frame(np.zeros(3), IDENTITY), "interface"),
        AttachmentFrame("/C/W", Frame(np.array([0.6, 0.0, 0.0]), IDENTITY), "interface"),
    ]
    return reduce_body(fe_mesh(points, tets), body, attachments, (), 0)


def test_a_linear_body_has_no_law(plastic):
    assert arm("linear", plastic).elasticity is None


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_a_nonlinear_body_has_more_modes_and_damping_of_its_own(plastic, law):
    linear, body = arm("linear", plastic), arm(law, plastic)
    assert body.elasticity is not None and body.elasticity.law == law
    assert len(body.stiffness) > len(linear.stiffness) == 6
    assert np.allclose(body.frequencies[:4], linear.frequencies[:4], rtol=1e-3)
    assert body.elasticity.retardation > 0.0
    r = len(body.stiffness)
    if law == "stvk":
        gram = body.elasticity.data.reshape(r + r * (r + 1) // 2, -1)
        assert np.allclose(np.diag(gram)[:r], body.stiffness, rtol=1e-6)
    else:
        assert body.elasticity.data.size == r * r + body.elasticity.points * (1 + 9 * r)
