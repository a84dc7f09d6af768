"""Strips whose thickness is a part of their width, which quadratic strain of modes may lock."""

import calmotion as cm
import numpy as np
import pytest
from boxes import box_tets
from calmotion.model import ElasticMaterial, FlexibleSettings
from calmotion.reduction.basis.craig_bampton import reduced_basis
from calmotion.reduction.basis.modal_derivatives import Support
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.material_laws.bending import searle_number
from calmotion.reduction.material_laws.laws import reduced_by_law
from full_order import FullOrder
from law_call import call_neohookean, call_stvk
from rigid_patch import pull
from swung_beam import Beam, swing

LENGTH, WIDTH, THICKNESS = 0.2, 0.076, 0.00127
MASS, INERTIA, MODULUS = 1.5, 0.05, 1.45e11
Y, Z = 0.5 * THICKNESS, 0.5 * WIDTH
STRIP = """#usda 1.0
(
    defaultPrim = "Robot"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
    timeCodesPerSecond = 100
    startTimeCode = 0
    endTimeCode = 100
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
        float calm:damping:ratio = 0
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


def deflected(thin, force, law):
    """A strip whose thickness is a part of its width, reduced for a force at its end [N], and its end's motion [m].

    Returns:
        The reduced strip, how far its end moves, and how far that of its mesh does.
    """
    thick = thin * WIDTH
    points, tets = box_tets((16, 6, 1), (LENGTH, WIDTH, thick), (0.0, -0.5 * WIDTH, -0.5 * thick))
    material = ElasticMaterial("/Looks/Steel", MODULUS, 0.3, 7850.0, damping_ratio=0.0)
    model, center = assemble(points, tets, material), np.array([LENGTH, 0.0, 0.0])
    x = model.mesh.nodes[:, 0]
    support = Support(np.flatnonzero(x < 1e-9), [np.flatnonzero(x > LENGTH - 1e-9)], [center])
    settings, none = FlexibleSettings(material, elasticity=law), np.zeros(3)
    loads = LoadEnvelope(none, none, none, 0.5 * force[None], np.zeros((1, 3)), 5.0, np.zeros(1))
    basis = reduced_basis(
        model, support.root, support.patches, support.centers, settings, load_envelope=loads, tolerance=5e-5
    )
    found = reduced_by_law(model, support, basis, settings, loads, 5e-4, "/Strip")
    full = FullOrder(points, tets, MODULUS, 0.3, 7850.0, law)
    moved = pull(full, support.root, support.patches[0], center, force)[0]
    return found, at_rest(found, force), moved


def at_rest(found, force):
    """How far the end of a reduced strip moves under a force, by Newton's method on the compiled forces."""
    law, motion = found.elasticity, found.basis.patch_motion[0, :3]
    r = motion.shape[1]
    u, f, P, K = np.zeros(r), np.zeros(6 + r), np.zeros((6 + r, 6 + r)), np.zeros((6 + r, 6 + r))
    for part in np.linspace(0.05, 1.0, 20):
        for _ in range(60):
            f[:], P[:], K[:] = 0.0, 0.0, 0.0
            if law.law == "stvk":
                call_stvk(law.data, u, np.zeros(r), 0.0, True, f, P, K, law.strain_projection)
            else:
                call_neohookean(law.points, u, np.zeros(r), law.lame, 0.0, law.data, True, f, P, K)
            step = np.linalg.solve(K[6:, 6:], part * force @ motion - f[6:])
            u += step
            if np.abs(motion @ step).max() < 1e-8 * LENGTH:
                break
    return motion @ u


@pytest.mark.parametrize(
    ("thin", "far", "law"),
    [
        pytest.param(1.0, 0.3, "stvk", marks=pytest.mark.long),
        pytest.param(0.1, 0.3, "stvk", marks=pytest.mark.long),
        pytest.param(1 / 30, 0.3, "stvk", marks=pytest.mark.long),
        (0.01, 0.2, "stvk"),
        pytest.param(1 / 30, 0.2, "neohookean", marks=pytest.mark.long),
    ],
)
def test_a_strip_deflects_like_its_mesh(thin, far, law):
    """By 0.2 to 0.3 of its length, within 1%. Without modes that flatten it, it would be 4 to 14% too stiff."""
    force = np.array([0.0, 0.0, 0.25 * MODULUS * WIDTH * (thin * WIDTH) ** 3 / LENGTH**2 * far])
    found, moved, expected = deflected(thin, force, law)
    assert np.linalg.norm(expected) > 0.85 * far * LENGTH
    assert np.allclose(moved, expected, rtol=0, atol=0.01 * np.linalg.norm(expected))
    assert len(found.basis.omega_squared) < 64


def test_a_steel_strip_swings_as_a_beam_does(tmp_path):
    """By a quarter of its length, stretched and bent by its load, without damping."""

    def angle(t):
        s = np.clip(np.asarray(t) / 0.4, 0.0, 1.0)
        return 0.6 * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)

    points = [(x, sy * Y, sz * Z) for x in (0.0, LENGTH) for sy, sz in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    samples = "{ " + ", ".join(f"{k}: {np.degrees(angle(k / 100.0))}" for k in range(101)) + " }"
    text = STRIP.format(modulus=MODULUS, mass=MASS, inertia=INERTIA, end=LENGTH, points=points, samples=samples)
    (tmp_path / "strip.usda").write_text(text)
    report = cm.simulate(tmp_path / "strip.usda", tolerance="0.5mm").report()
    assert any("nonlinear strain" in row["what"] for row in report["left_out"])
    area, second = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12.0
    beam = Beam(MODULUS * area, 5.0 / 12.0 * MODULUS * area, MODULUS * second, 7850.0 * area, 7850.0 * second)
    tip = swing(LENGTH, beam, (MASS, INERTIA), angle, 1e-3, 1.0, 8)[1]
    largest = np.linalg.norm(tip - [LENGTH, 0.0], axis=1).max()
    assert largest > 0.25 * LENGTH
    assert report["targets"][0]["max_error_m"] == pytest.approx(largest, rel=0.005)


def test_the_searle_number_tells_strips_that_flatten_from_arms_that_do_not():
    """w^2 / (R t), whatever way the body lies."""
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    corners = np.array([[x, y, z] for x in (0.0, 0.3) for y in (0.0, 0.06) for z in (0.0, 0.002)])
    radius = 0.3**2 / (2.0 * 0.05)
    assert searle_number(corners @ turn, 0.05) == pytest.approx(0.06**2 / (radius * 0.002))
    assert searle_number(corners * [1.0, 1.0, 30.0], 0.05) < 0.1
