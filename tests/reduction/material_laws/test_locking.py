"""Wide thin strips, which quadratic strain of modes locks."""

from __future__ import annotations

import calmotion as cm
import numpy as np
import pytest
from calmotion.reduction.material_laws.locking import share_of_deflection
from calmotion.reduction.reduced_body import Elasticity
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.linalg import eigh

LENGTH, WIDTH, THICKNESS = 0.2, 0.076, 0.00127
MASS, INERTIA, MODULUS = 1.5, 0.05, 1.45e11
X, Y, Z = (0.05, 0.05 + LENGTH), 0.5 * THICKNESS, 0.5 * WIDTH
STRIP = """#usda 1.0
(
    defaultPrim = "Robot"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
    timeCodesPerSecond = 100
    startTimeCode = 0
    endTimeCode = 150
)
def PhysicsScene "Physics"
{{
    vector3f physics:gravityDirection = (0, 0, -1)
    float physics:gravityMagnitude = 0
}}
def Xform "Robot" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])
{{
    def Material "Steel" (prepend apiSchemas = ["PhysicsVolumeDeformableMaterialAPI", "CalmDampingAPI"])
    {{
        float physics:youngsModulus = {modulus}
        float physics:poissonsRatio = 0.0
        float physics:density = 7850
        float calm:damping:ratio = 0.1
    }}
    def Xform "Link" (
        prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI", "CalmFlexibleBodyAPI", "MaterialBindingAPI"]
    )
    {{
        rel material:binding:physics = </Robot/Steel>
        def Mesh "Strip"
        {{
            point3f[] points = {points}
            int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
            int[] faceVertexIndices = [0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7]
            uniform token subdivisionScheme = "none"
            def GeomSubset "Hub"
            {{
                uniform token elementType = "face"
                uniform token familyName = "calmInterface"
                int[] indices = [0]
            }}
            def GeomSubset "Wrist"
            {{
                uniform token elementType = "face"
                uniform token familyName = "calmInterface"
                int[] indices = [1]
            }}
        }}
    }}
    def Xform "Load" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {{
        float physics:mass = {mass}
        point3f physics:centerOfMass = (0, 0, 0)
        float3 physics:diagonalInertia = ({inertia}, {inertia}, {inertia})
        double3 xformOp:translate = ({end}, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Xform "Tip" (prepend apiSchemas = ["CalmTargetAPI"])
        {{
        }}
    }}
    def PhysicsRevoluteJoint "Hub" (prepend apiSchemas = ["PhysicsDriveAPI:angular"])
    {{
        uniform token physics:axis = "Z"
        rel physics:body1 = </Robot/Link>
        float drive:angular:physics:targetPosition.timeSamples = {samples}
    }}
    def PhysicsFixedJoint "Wrist"
    {{
        rel physics:body0 = </Robot/Link>
        rel physics:body1 = </Robot/Load>
        point3f physics:localPos0 = ({end}, 0, 0)
    }}
}}
"""


def test_the_share_is_that_of_a_spring_that_stiffens():
    stiff, cubic, linear = 4.0, 30.0, 0.3
    law = Elasticity("stvk", 0.0, np.array([[stiff, 0.0], [0.0, cubic]]).ravel())
    deflection = next(x.real for x in np.roots([2.0 * cubic, 0.0, stiff, -stiff * linear]) if abs(x.imag) < 1e-9)
    found = share_of_deflection(law, np.array([stiff]), np.array([linear]))
    assert found == pytest.approx(deflection / linear, rel=1e-5)


def test_a_steel_strip_swings_as_a_beam_does(tmp_path):
    """More than six thicknesses far, by nonlinear strain."""
    times = np.arange(151) / 100.0
    s = np.clip(times / 0.5, 0.0, 1.0)
    angles = 0.2 * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    points = [(x, sy * Y, sz * Z) for x in X for sy, sz in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    samples = "{ " + ", ".join(f"{k}: {np.degrees(angle)}" for k, angle in enumerate(angles)) + " }"
    text = STRIP.format(modulus=MODULUS, mass=MASS, inertia=INERTIA, end=X[1], points=points, samples=samples)
    (tmp_path / "strip.usda").write_text(text)
    result = cm.simulate(tmp_path / "strip.usda", tolerance="0.5mm")
    report = result.report()
    assert not any("linear elasticity" in row["what"] for row in report["left_out"])

    # tip of a Euler-Bernoulli beam without mass that carries the load
    EI = MODULUS * WIDTH * THICKNESS**3 / 12.0
    K = EI * np.array([[12.0 / LENGTH**3, -6.0 / LENGTH**2], [-6.0 / LENGTH**2, 4.0 / LENGTH]])
    M, motion = np.diag([MASS, INERTIA]), CubicSpline(times, angles)
    values, V = eigh(K, M)
    C = M @ V @ np.diag(0.2 * np.sqrt(values)) @ V.T @ M
    load = M @ np.array([X[1], 1.0])

    def rates(t, y):
        return np.concatenate([y[2:], np.linalg.solve(M, -K @ y[:2] - C @ y[2:] - load * motion(t, 2))])

    beam = solve_ivp(rates, (0.0, 1.5), np.zeros(4), t_eval=times, rtol=1e-8, atol=1e-10).y[0]
    assert np.abs(beam).max() > 6.0 * THICKNESS
    largest = report["targets"][0]["max_error_m"]
    assert largest == pytest.approx(np.abs(beam).max(), rel=0.05)
