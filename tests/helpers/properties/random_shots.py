"""Random robots and their motions for hypothesis: trees of rigid and flexible bodies on joints of every kind, in SI."""

from dataclasses import dataclass, replace
from unittest.mock import patch

import four_bar
import numpy as np
from calmotion.model import (
    WORLD,
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
from calmotion.testing import beam_mesh, quintic
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

RATE = 24.0  # frames a second
FRAMES = 12
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
DRIVEN = ("revolute motor", "prismatic motor")
KINDS = {
    "fixed": "fixed", "revolute motor": "revolute", "prismatic motor": "prismatic", "hinge": "revolute",
    "ball": "spherical", "slider": "prismatic",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Shot:
    """A character, what it performs, and the meshes of its flexible bodies."""

    character: Character
    animation: Animation
    meshes: FEMeshes


@dataclass(frozen=True)
class Beam:
    """A square beam along x: [m], [m], [Pa], [kg/m^3], ratio of critical damping, elastic law."""

    length: float
    thickness: float
    modulus: float
    density: float
    damping: float
    law: str


@dataclass(frozen=True)
class Lump:
    """A rigid box: mass [kg], edges [m], centre [m] in the body frame."""

    mass: float
    edges: tuple[float, float, float]
    center: tuple[float, float, float]


@dataclass(frozen=True)
class Link:
    """A body and the joint that carries it.

    Attributes:
        parent: Number of the link that carries it, -1 for the world.
        kind: One of `KINDS`.
        flipped: Whether the joint names the body first and its parent second.
        stuff: What the body is.
        near, far: Position of the joint in the parent and in the body [m]; on a beam it sits on an end face.
        turns: Rotation vectors of the joint's frames there [rad].
        rest: Value of a passive joint in the first pose [rad or m].
        moves: (change [rad or 0.1 m], start [s], duration [s]) of each quintic that a motor performs.
    """

    parent: int
    kind: str
    flipped: bool
    stuff: Beam | Lump
    near: tuple[float, float, float]
    far: tuple[float, float, float]
    turns: tuple[tuple[float, float, float], tuple[float, float, float]]
    rest: float
    moves: tuple[tuple[float, float, float], ...]


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers of a range, zero and small ones among them."""
    return st.floats(low, high, allow_subnormal=False)


def triples(size: float) -> st.SearchStrategy[tuple[float, float, float]]:
    """Vectors in a cube of half that edge."""
    return st.tuples(*[numbers(-size, size)] * 3)


# few sizes and materials, so that a reduced body is found in the cache of the machine
def beams(moduli=(1e7, 1e8, 1e9, 1e10, 1e11), ratios=(0.0, 0.01, 0.1), laws=("linear", "stvk")):
    """Flexible links; the softest bend under their own weight."""
    return st.builds(
        Beam, st.sampled_from((0.2, 0.4)), st.sampled_from((0.02, 0.04)), st.sampled_from(moduli),
        st.sampled_from((1000.0, 8000.0)), st.sampled_from(ratios), st.sampled_from(laws),
    )  # fmt: skip


def lumps(decades: float = 2.0):
    """Rigid bodies of 1 kg, up to so many decades more or less."""
    return st.builds(
        Lump, numbers(-decades, decades).map(lambda x: 10.0**x), st.tuples(*[numbers(0.02, 0.3)] * 3), triples(0.2)
    )


MOVES = st.lists(st.tuples(numbers(-1.5, 1.5), numbers(0.0, 0.2), numbers(0.15, 0.3)), min_size=1, max_size=2)


@st.composite
def trees(draw, kinds=tuple(KINDS), stuff=None, most: int = 6) -> tuple[Link, ...]:
    """One to six links, each on the world or on one before it."""
    if stuff is None:
        stuff = st.one_of(lumps(), beams())
    count = draw(st.integers(1, most))
    return tuple(
        Link(
            draw(st.integers(max(WORLD, k - 3), k - 1)), draw(st.sampled_from(kinds)), draw(st.booleans()), draw(stuff),
            draw(triples(0.3)), draw(triples(0.3)), draw(st.tuples(triples(3.0), triples(3.0))),
            draw(numbers(-1.0, 1.0)), tuple(draw(MOVES)),
        )
        for k in range(count)
    )  # fmt: skip


def directions() -> st.SearchStrategy[tuple[float, float, float]]:
    """Gravity [m/s^2]: earth's, in any direction."""
    return triples(3.0).map(lambda turn: tuple(9.81 * Rotation.from_rotvec(turn).as_matrix()[:, 2]))


def quaternion(rotation: Rotation):
    """Unit quaternion (w, x, y, z)."""
    return rotation.as_quat(scalar_first=True)


def rotation_of(frame: Frame) -> Rotation:
    """The rotation of a frame."""
    return Rotation.from_quat(frame.rotation, scalar_first=True)


def beyond(frame: Frame, other: Frame) -> Frame:
    """A frame given in another."""
    turn = rotation_of(frame)
    return Frame(frame.position + turn.apply(other.position), quaternion(turn * rotation_of(other)))


def inverse(frame: Frame) -> Frame:
    """The frame in which it is the identity."""
    back = rotation_of(frame).inv()
    return Frame(-back.apply(frame.position), quaternion(back))


def _joint_value(kind: str, value: float) -> Frame:
    if KINDS[kind] == "prismatic":
        return Frame(np.array([0.0, 0.0, value]), IDENTITY)
    return Frame(np.zeros(3), quaternion(Rotation.from_rotvec([0.0, 0.0, 0.0 if kind == "fixed" else value])))


def _body(path: str, rest: Frame, stuff: Beam | Lump) -> Body:
    if isinstance(stuff, Beam):
        material = ElasticMaterial("/R/Stuff", stuff.modulus, 0.3, stuff.density, stuff.damping)
        settings = FlexibleSettings(material, mode_count=6, elasticity=stuff.law)
        return Body(path, rest, None, flexible=settings)
    a, b, c = np.square(stuff.edges)
    inertia = stuff.mass / 12.0 * np.diag([b + c, c + a, a + b])
    return Body(path, rest, MassProperties(stuff.mass, np.array(stuff.center), inertia))


def _motion(link: Link, times):
    size = 0.1 if KINDS[link.kind] == "prismatic" else 1.0
    return sum(size * quintic(turn, seconds, start)(times) for turn, start, seconds in link.moves)


def build(links: tuple[Link, ...], gravity: tuple[float, float, float]) -> Shot:
    """The shot that the links perform; its target is the far end of the last one."""
    bodies: list[Body] = []
    joints, motors, tracks, meshes = [], [], [], []
    times = np.arange(FRAMES + 1) / RATE
    for k, link in enumerate(links):
        parent = links[link.parent].stuff if link.parent != WORLD else None
        near = np.array([parent.length, 0.0, 0.0] if isinstance(parent, Beam) else link.near)
        far = np.zeros(3) if isinstance(link.stuff, Beam) else np.array(link.far)
        on_parent, on_body = (
            Frame(at, quaternion(Rotation.from_rotvec(turn))) for at, turn in zip((near, far), link.turns, strict=True)
        )
        driven = link.kind in DRIVEN
        value = (0.1 if KINDS[link.kind] == "prismatic" else 1.0) * (0.0 if driven else link.rest)
        carrier = Frame(np.zeros(3), IDENTITY) if link.parent == WORLD else bodies[link.parent].rest
        here = _joint_value(link.kind, value)
        rest = beyond(beyond(beyond(carrier, on_parent), here), inverse(on_body))
        bodies.append(_body(f"/R/B{k}", rest, link.stuff))
        path, kind = f"/R/J{k}", KINDS[link.kind]
        if link.flipped and link.parent != WORLD:
            joints.append(Joint(path, kind, k, link.parent, on_body, on_parent))
        else:
            joints.append(Joint(path, kind, link.parent, k, on_parent, on_body))
        if driven:
            motors.append(Motor(k, path, "drive", linear=kind == "prismatic"))
            tracks.append(Track(times, _motion(link, times)))
        if isinstance(link.stuff, Beam):
            mesh = beam_mesh(link.stuff.length, link.stuff.thickness, 3)
            meshes.append(FEMesh(k, *mesh, MeshQuality(0.0, 0.0, 0.0)))
    last = links[-1].stuff
    tip = np.array([last.length, 0.0, 0.0] if isinstance(last, Beam) else [0.1, 0.0, 0.0])
    target = Target("/R/Target", len(links) - 1, Frame(tip, IDENTITY))
    character = Character("/R", tuple(bodies), tuple(joints), tuple(motors), (target,), np.array(gravity))
    return Shot(character, Animation(times, tuple(tracks), tuple(tracks)), FEMeshes(tuple(meshes)))


def shots(**options) -> st.SearchStrategy[Shot]:
    """Random shots; options as of `trees`."""
    return st.builds(build, trees(**options), directions())


@st.composite
def linkages(draw) -> Shot:
    """A driven crank, a flexible coupler and a rocker: one closed loop, of lengths with which the crank can turn."""
    lengths = {
        "CRANK": draw(numbers(0.08, 0.14)), "COUPLER": draw(st.sampled_from((0.4, 0.44))),
        "ROCKER": draw(numbers(0.36, 0.44)), "GROUND": draw(numbers(0.46, 0.5)),
    }  # fmt: skip
    with patch.multiple(four_bar, **lengths):
        character, meshes = four_bar.four_bar(elasticity=draw(st.sampled_from(("linear", "stvk"))))
    # where a loop is cut decides how the coupler is carried, so the shot says it
    joints = tuple(replace(joint, closes_chain=k == 3) for k, joint in enumerate(character.joints))
    character = replace(character, joints=joints, gravity=np.array(draw(directions())))
    times = np.arange(FRAMES + 1) / RATE
    tracks = (Track(times, sum(turn * quintic(1.0, seconds, start)(times) for turn, start, seconds in draw(MOVES))),)
    return Shot(character, Animation(times, tracks, tracks), meshes)
