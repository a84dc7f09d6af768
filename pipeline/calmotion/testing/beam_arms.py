"""Synthetic arms of prismatic beams: no shot and no mesher, so results are the same on every machine."""

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.tetrahedra import oriented_tets
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
from calmotion.multibody import ReducedBody
from calmotion.multibody.model.model import body_anchors, rigid_body
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
LIFTS = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])  # joint axis z along -y: a positive angle lifts the arm


def _at(x: float, rotation: Array = IDENTITY) -> Frame:
    return Frame(np.array([x, 0.0, 0.0]), rotation)


def beam_mesh(
    length: float, thickness: float, cells: int, across: int = 2, grading: tuple[float, float] = (1.0, 1.0)
) -> tuple[Array, IntArray]:
    """A square beam along x of so many cells along and across; points [m], shape [n, 3], and tetrahedra.

    Args:
        length, thickness: [m].
        cells, across: Elements along the beam, and across it.
        grading: Exponents by which they become smaller towards the ends, and towards the edges, where strains are
            singular; 1: equal ones.
    """
    from skfem import MeshTet

    side = 0.5 * thickness * _graded(across, grading[1])
    mesh = MeshTet.init_tensor(0.5 * length * (1.0 + _graded(cells, grading[0])), side, side)
    points = np.ascontiguousarray(mesh.p.T)
    return points, oriented_tets(points, mesh.t.T)[0]


def _graded(count: int, exponent: float) -> Array:
    """Bounds of so many cells from -1 to 1, which are smaller towards both ends, shape [count + 1]."""
    even = np.linspace(-1.0, 1.0, count + 1)
    return np.asarray(np.sign(even) * (1.0 - (1.0 - np.abs(even)) ** exponent))


# parameters: dimensions, material and discretisation in SI units; a benchmark names the few in which its arm differs
def beam_arm(
    links: int = 1, length: float = 0.6, thickness: float = 0.02, youngs_modulus: float = 1.8e9,
    density: float = 1200.0, payload: float = 0.2, damping: float = 0.01, gravity: float = 9.81,
    elasticity: str = "auto", modes: int = -1, cells: int = 12, across: int = 2,
    grading: tuple[float, float] = (1.0, 1.0),
) -> tuple[Character, FEMeshes]:  # fmt: skip
    """An arm along x of flexible links, each on a motor that lifts it, with a rigid load welded to the end.

    The defaults are those of a slender plastic arm: 0.6 m, 20 mm square, with 0.2 kg at its end it swings at 5.6 Hz.

    Args:
        links: Number of links, each `length` [m] long.
        length, thickness: [m].
        youngs_modulus, density: [Pa], [kg/m^3]; Poisson's ratio is 0.35.
        payload: [kg].
        damping: Ratio of critical.
        gravity: Down the z axis [m/s^2].
        elasticity, modes: See `FlexibleSettings`.
        cells, across, grading: Of the mesh of a link, as of `beam_mesh`.
    """
    material = ElasticMaterial("/Arm/Plastic", youngs_modulus, 0.35, density, damping)
    settings = FlexibleSettings(material, mode_count=modes, elasticity=elasticity)
    bodies = [Body(f"/Arm/Link{k}", _at(k * length), None, flexible=settings) for k in range(links)]
    # a cube, as heavy as the load, of an edge of two thicknesses
    inertia = payload * (2.0 * thickness) ** 2 / 6.0 * np.eye(3)
    bodies.append(Body("/Arm/Load", _at(links * length), MassProperties(payload, np.zeros(3), inertia)))
    joints = [
        Joint(f"/Arm/Joint{k}", "revolute", k - 1, k, _at(length if k else 0.0, LIFTS), _at(0.0, LIFTS))
        for k in range(links)
    ]
    joints.append(Joint("/Arm/Weld", "fixed", links - 1, links, _at(length), _at(0.0)))
    motors = tuple(Motor(k, joints[k].path, "drive:angular:physics:targetPosition") for k in range(links))
    target = Target("/Arm/Load", links, _at(0.0))
    points, tets = beam_mesh(length, thickness, cells, across, grading)
    meshes = FEMeshes(tuple(FEMesh(k, points, tets, MeshQuality(0.0, 0.0, 0.0)) for k in range(links)))
    down = np.array([0.0, 0.0, -gravity])
    return Character("/Arm", tuple(bodies), tuple(joints), motors, (target,), down), meshes


def quintic(turn: float, seconds: float, start: float = 0.0) -> Callable[[Array], Array]:
    """A move from rest to rest: its angle [rad] over time [s]."""

    def angle(t: Array) -> Array:
        s = np.clip((np.asarray(t) - start) / seconds, 0.0, 1.0)
        return turn * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)

    return angle


def shot_of(angle: Callable[[Array], Array], seconds: float, motors: int = 1, rate: float = 24.0) -> Animation:
    """A shot of so many seconds at `rate` frames a second in which every motor follows the same curve."""
    times = np.arange(round(seconds * rate) + 1) / rate
    tracks = tuple(Track(times, angle(times)) for _ in range(motors))
    return Animation(times, tracks, tracks)


def link_chain(count: int, modes: int, cells: int = 4) -> tuple[Character, list[ReducedBody]]:
    """A chain of steel links that are all the same reduced body, with a load; every joint has a motor."""
    made = {"length": 0.1, "youngs_modulus": 2.1e11, "density": 7800.0, "elasticity": "linear", "modes": modes}
    short, meshes = beam_arm(links=2, cells=cells, **made)  # type: ignore[arg-type]
    bodies = reduce_bodies(short, span_tree(short), meshes)
    if count == 1:
        single, meshes = beam_arm(links=1, cells=cells, **made)  # type: ignore[arg-type]
        return single, reduce_bodies(single, span_tree(single), meshes)
    chain, _ = beam_arm(links=count, cells=cells, **made)  # type: ignore[arg-type]
    load = body_anchors(chain, span_tree(chain))[-1]
    return chain, [bodies[0]] * count + [rigid_body(chain.bodies[-1], load)]


def branched_links() -> tuple[Character, list[ReducedBody]]:
    """A tree of 14 links with 10 modes each: a trunk of 2 and four limbs of 3, no loads."""
    chain, bodies = link_chain(14, 10)
    parents = [-1, 0] + [1 if k % 3 == 0 else k + 1 for k in range(12)]
    moved = [replace(joint, body0=p) for joint, p in zip(chain.joints[:14], parents, strict=True)]
    moved[0] = chain.joints[0]
    items: tuple[Body, ...] = chain.bodies[:14]
    target = replace(chain.targets[0], body=13)
    tree = replace(chain, bodies=items, joints=tuple(moved), motors=chain.motors[:14], targets=(target,))
    # all joints beyond a link's root sit on its end, so that one reduced body with one moving interface serves them all
    root, end = bodies[0].markers[:2]
    shared = []
    for anchors in body_anchors(tree, span_tree(tree)):
        beyond = len(anchors.joints) - 1 + len(anchors.targets)
        shared.append(replace(bodies[0], markers=(root, *[end] * beyond)))
    return tree, shared


@contextmanager
def fresh_cache() -> Iterator[None]:
    """An empty cache folder for a while, so that results are computed again; it is not for threads."""
    before = os.environ.get("CALMOTION_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["CALMOTION_CACHE"] = folder
        try:
            yield
        finally:
            if before is None:
                del os.environ["CALMOTION_CACHE"]
            else:
                os.environ["CALMOTION_CACHE"] = before
