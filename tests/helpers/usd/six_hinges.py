"""An arm of six links of 0.2 m on six hinges, one of them oblique, as a USD shot of one second, and its tip."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

LENGTH = 0.2
TIP = "/Arm/Link6/Tip"
TIP_PLACE = np.array([0.05, 0.0, LENGTH])
NAMES = [f"Hinge{k}" for k in range(1, 7)]
PATHS = [f"/Arm/{name}" for name in NAMES]
OBLIQUE = np.radians(35.0)  # of the fourth hinge, about x
AXES = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [0, -np.sin(OBLIQUE), np.cos(OBLIQUE)], [0, 1, 0], [1, 0, 0]], float)
_LETTERS = "ZYYZYX"
TIMES = np.arange(25) / 24.0
SWINGS = np.array([0.5, -0.4, 0.6, 0.5, -0.6, 0.4])


def track_values() -> np.ndarray:
    """Samples of the drives [rad], shape [25, 6]: each swings out and back, some of them twice."""
    turns = np.array([1, 1, 2, 1, 2, 1])
    return SWINGS * 0.5 * (1.0 - np.cos(2.0 * np.pi * TIMES[:, None] * turns))


def smooth(times: np.ndarray) -> np.ndarray:
    """The curves through the samples [rad], shape [n, 6]."""
    return CubicSpline(TIMES, track_values())(np.clip(times, 0.0, 1.0))


def tip_of(angles: np.ndarray) -> np.ndarray:
    """Place of the tip [m] for angles of shape [n, 6], by multiplying transforms."""
    point = np.tile(TIP_PLACE, (len(angles), 1))
    for k in range(5, -1, -1):
        point = Rotation.from_rotvec(angles[:, k, None] * AXES[k]).apply(point)
        if k > 0:
            point = point + [0.0, 0.0, LENGTH]
    return point


def six_hinges() -> str:
    """The shot."""
    bodies, joints = [], []
    values = np.degrees(track_values())
    half = 0.5 * OBLIQUE
    for k, letter in enumerate(_LETTERS):
        tip = "" if k < 5 else (
            '        def Xform "Tip" (prepend apiSchemas = ["CalmTargetAPI"])\n        {\n'
            f"            double3 xformOp:translate = ({TIP_PLACE[0]}, {TIP_PLACE[1]}, {TIP_PLACE[2]})\n"
            '            uniform token[] xformOpOrder = ["xformOp:translate"]\n        }\n'
        )  # fmt: skip
        bodies.append(
            f'    def Xform "Link{k + 1}" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])\n    {{\n'
            "        float physics:mass = 0.5\n        float3 physics:diagonalInertia = (0.002, 0.002, 0.001)\n"
            f"        double3 xformOp:translate = (0, 0, {k * LENGTH})\n"
            '        uniform token[] xformOpOrder = ["xformOp:translate"]\n'
            '        def Cube "Bar"\n        {\n            double size = 0.05\n        }\n'
            f"{tip}    }}\n"
        )
        turned = f"({np.cos(half):.9f}, {np.sin(half):.9f}, 0, 0)" if k == 3 else "(1, 0, 0, 0)"
        samples = ", ".join(f"{n}: {value:.9g}" for n, value in enumerate(values[:, k]))
        base = f"        rel physics:body0 = </Arm/Link{k}>\n" if k else ""
        joints.append(
            f'    def PhysicsRevoluteJoint "{NAMES[k]}" (prepend apiSchemas = ["PhysicsDriveAPI:angular"])\n    {{\n'
            f'        uniform token physics:axis = "{letter}"\n{base}'
            f"        rel physics:body1 = </Arm/Link{k + 1}>\n"
            f"        point3f physics:localPos0 = (0, 0, {LENGTH if k else 0})\n"
            f"        quatf physics:localRot0 = {turned}\n        quatf physics:localRot1 = {turned}\n"
            f"        float drive:angular:physics:targetPosition.timeSamples = {{ {samples} }}\n    }}\n"
        )
    return (
        '#usda 1.0\n(\n    defaultPrim = "Arm"\n    endTimeCode = 24\n    kilogramsPerUnit = 1\n    metersPerUnit = 1\n'
        '    startTimeCode = 0\n    timeCodesPerSecond = 24\n    upAxis = "Z"\n)\n'
        'def Xform "Arm" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])\n{\n'
        + "".join([*bodies, *joints])
        + "}\n"
    )
