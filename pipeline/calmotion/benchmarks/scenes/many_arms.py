"""Many small arms on one base as a USD shot: bodies, motors and frames grow without changing what a link is."""

from __future__ import annotations

from pathlib import Path

import numpy as np

LENGTH, WIDTH, RATE = 0.12, 0.02, 24.0  # of a link [m], of the shot [1/s]
LINKS = 5  # in an arm
_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def write_many_arms(path: Path, bodies: int, motors: int | None = None, frames: int = 24) -> Path:
    """Write the shot.

    Args:
        path: Where.
        bodies: Number of flexible links, in arms of `LINKS`, each with a target at its tip.
        motors: How many hinges have one, each a wave of its own; the others are fixed joints. None: all.
        frames: Number of frames after the first.

    Returns:
        The path.
    """
    driven = np.floor(np.arange(1, bodies + 1) * (bodies if motors is None else motors) / bodies)
    has_motor = np.diff(driven, prepend=0.0) > 0.0
    t = np.arange(frames + 1) / RATE
    parts = []
    for k in range(bodies):
        swing = 6.0 * (1.0 - np.cos(2.0 * np.pi * t * (1.0 + 0.1 * (k % 7)))) * (-1.0) ** k
        parts.append(_link(k, k % LINKS == LINKS - 1 or k == bodies - 1))
        parts.append(_hinge(k, swing if has_motor[k] else None))
    # a line at a time: the text of 200 motors over minutes is large
    with path.open("w", encoding="utf-8") as file:
        file.write(
            f'#usda 1.0\n(\n    defaultPrim = "Arms"\n    endTimeCode = {frames}\n    kilogramsPerUnit = 1\n'
            f'    metersPerUnit = 1\n    startTimeCode = 0\n    timeCodesPerSecond = {RATE:g}\n    upAxis = "Z"\n)\n'
            f'def Xform "Arms" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])\n{{\n{_MATERIAL}{_BASE}'
        )
        file.writelines(parts)
        file.write("}\n")
    return path


_MATERIAL = """\
    def Material "Nylon" (prepend apiSchemas = ["PhysicsVolumeDeformableMaterialAPI"])
    {
        float physics:youngsModulus = 2e9
        float physics:poissonsRatio = 0.4
        float physics:density = 1100
    }
"""
_BASE = """\
    def Xform "Base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 20
        float3 physics:diagonalInertia = (1, 1, 1)
    }
    def PhysicsFixedJoint "Stand"
    {
        rel physics:body1 = </Arms/Base>
    }
"""


def _place(k: int) -> tuple[float, float]:
    """Where a link begins, along the row of arms and along its arm [m]."""
    return 0.2 * (k // LINKS), LENGTH * (k % LINKS)


def _link(k: int, last: bool) -> str:
    x, z = _place(k)
    half = 0.5 * WIDTH
    corners = [(dx, dy, dz) for dx in (-half, half) for dy in (-half, half) for dz in (0.0, LENGTH)]
    tip = (
        '        def Xform "Tip" (prepend apiSchemas = ["CalmTargetAPI"])\n        {\n'
        f"            double3 xformOp:translate = (0, 0, {LENGTH})\n"
        '            uniform token[] xformOpOrder = ["xformOp:translate"]\n        }\n'
    )
    return (
        f'    def Xform "Link{k}" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "CalmFlexibleBodyAPI", '
        '"MaterialBindingAPI"])\n    {\n        rel material:binding:physics = </Arms/Nylon>\n'
        f"        double3 xformOp:translate = ({x:.9g}, 0, {z:.9g})\n"
        '        uniform token[] xformOpOrder = ["xformOp:translate"]\n'
        '        def Mesh "Skin"\n        {\n            uniform token subdivisionScheme = "none"\n'
        f"            int[] faceVertexCounts = {[4] * len(_FACES)}\n"
        f"            int[] faceVertexIndices = {[i for face in _FACES for i in face]}\n"
        f"            point3f[] points = {corners}\n        }}\n{tip if last else ''}    }}\n"
    )


def _hinge(k: int, angles: np.ndarray | None) -> str:
    x, z = _place(k)
    first = k % LINKS == 0
    parent = "Base" if first else f"Link{k - 1}"
    at = (x, 0, 0) if first else (0, 0, LENGTH)
    ends = (
        f"        rel physics:body0 = </Arms/{parent}>\n        rel physics:body1 = </Arms/Link{k}>\n"
        f"        point3f physics:localPos0 = {at}\n"
    )
    if angles is None:
        return f'    def PhysicsFixedJoint "Joint{k}"\n    {{\n{ends}    }}\n'
    samples = ", ".join(f"{n}: {value:.6g}" for n, value in enumerate(angles))
    return (
        f'    def PhysicsRevoluteJoint "Joint{k}" (prepend apiSchemas = ["PhysicsDriveAPI:angular"])\n    {{\n'
        f'        uniform token physics:axis = "Y"\n{ends}'
        f"        float drive:angular:physics:targetPosition.timeSamples = {{ {samples} }}\n    }}\n"
    )
