"""A small flexible character for the tests of the retargeting."""

import numpy as np
import pytest
from calmotion.model import (
    Animation,
    Body,
    Character,
    ElasticMaterial,
    FEMesh,
    FEMeshes,
    FlexibleSettings,
    Frame,
    Joint,
    MassProperties,
    MeshQuality,
    Motor,
    Target,
    Track,
)
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies

LENGTH = 0.32
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
Z_TO_Y = np.array([np.cos(np.pi / 4), -np.sin(np.pi / 4), 0.0, 0.0])


def frame(x=0.0, rotation=IDENTITY):
    return Frame(np.array([x, 0.0, 0.0]), rotation)


def link(elements=8, width=0.022):
    from skfem import MeshTet

    across = np.array([-width / 2, width / 2])
    mesh = MeshTet.init_tensor(np.linspace(0.0, LENGTH, elements + 1), across, across)
    return np.ascontiguousarray(mesh.p.T), np.ascontiguousarray(mesh.t.T.astype(np.int32))


def ease(times, start, length):
    s = np.clip((times - start) / length, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


@pytest.fixture(scope="session")
def arm():
    """A shoulder yaw, an elbow, two plastic links and a payload of half a kilogram that must not tilt."""
    plastic = FlexibleSettings(ElasticMaterial("/Arm/Nylon", 2e9, 0.35, 1100.0, 0.015))
    bodies = (
        Body("/Arm/Upper", frame(), None, flexible=plastic),
        Body("/Arm/Fore", frame(LENGTH), None, flexible=plastic),
        Body("/Arm/Hand", frame(2 * LENGTH), MassProperties(0.5, np.array([0.03, 0.0, 0.0]), 3e-4 * np.eye(3))),
    )
    joints = (
        Joint("/Arm/Shoulder", "revolute", -1, 0, frame(), frame(), -2.0, 2.0),
        Joint("/Arm/Elbow", "revolute", 0, 1, frame(LENGTH, Z_TO_Y), frame(0.0, Z_TO_Y), -2.0, 2.0),
        Joint("/Arm/Wrist", "fixed", 1, 2, frame(LENGTH), frame()),
    )
    motors = tuple(Motor(k, joints[k].path, "drive:angular:physics:targetPosition") for k in range(2))
    targets = (Target("/Arm/Fore/elbow", 1, frame()), Target("/Arm/Hand/cup", 2, frame(0.05), 1.0, 0.05))
    return Character("/Arm", bodies, joints, motors, targets, np.array([0.0, 0.0, -9.81]))


def at_rate(rate):
    """Two fast moves in 1.5 s at so many frames a second, starting at rest."""
    times = np.arange(round(1.5 * rate) + 1) / rate
    shoulder = -0.9 * ease(times, 0.25, 0.4) + 0.7 * ease(times, 0.8, 0.35)
    elbow = 0.6 * ease(times, 0.3, 0.4) - 0.8 * ease(times, 0.85, 0.3)
    tracks = (Track(times, shoulder), Track(times, elbow))
    return Animation(times, tracks, tracks)


@pytest.fixture(scope="session")
def moves():
    return at_rate


@pytest.fixture(scope="session")
def animation():
    return at_rate(24.0)


@pytest.fixture(scope="session")
def meshes():
    points, tets = link()
    return FEMeshes(tuple(FEMesh(k, points, tets, MeshQuality(0.0, 0.0, 0.0)) for k in range(2)))


@pytest.fixture(scope="session")
def bodies(arm, meshes):
    return reduce_bodies(arm, span_tree(arm), meshes)
