"""Gantries for tests: rigid carriages on slides, and beams on them that bend, twist and stretch."""

import numpy as np
from calmotion.model import Body, Character, Frame, Joint, MassProperties, Motor, Target
from calmotion.multibody.model.model import body_anchors, compile_model, rigid_body
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction.reduced_body import Invariants, Marker, ReducedBody
from numpy.polynomial import Chebyshev, Polynomial
from scipy.linalg import eigh

STILL = np.array([1.0, 0.0, 0.0, 0.0])
HALF = np.sqrt(0.5)
Z_TO_X = np.array([HALF, 0.0, HALF, 0.0])
Z_TO_Y = np.array([HALF, -HALF, 0.0, 0.0])
UP = np.array([HALF, 0.0, -HALF, 0.0])  # a beam's own axis, its x, to z
ASIDE = np.array([HALF, 0.0, 0.0, HALF])  # x to y
LENGTH, MASS, HALF_WIDTH = 0.5, 0.6, 0.01
BENDING, TWISTING, STRETCHING = 30.0, 15.0, 4e5  # [N m^2], [N m^2], [N]


def beam(bending=4, others=2, ratio=0.01) -> ReducedBody:
    """A square beam along x, held at its origin, with markers there and at its tip.

    Bernoulli's kinematics on polynomials: twice `bending` modes that bend, twice `others` that twist and stretch. Its
    mass is that of points at the corners of cross sections.

    Args:
        ratio: Of the critical damping, of each mode.
    """
    x, weight = np.polynomial.legendre.leggauss(2 * bending + 6)
    x, weight = 0.5 * LENGTH * (x + 1.0), 0.5 * weight  # of the length
    held = Polynomial([0.0, 1.0])
    shape = [Chebyshev.basis(k, domain=[0.0, LENGTH]).convert(kind=Polynomial) for k in range(max(bending, others))]
    bent, drawn = [held**2 * s for s in shape[:bending]], [held * s for s in shape[:others]]
    fields = [(kind, f) for kind, some in enumerate((bent, bent, drawn, drawn)) for f in some]
    y, z = HALF_WIDTH * np.array([[1.0, -1.0, -1.0, 1.0], [1.0, 1.0, -1.0, -1.0]])
    points = np.stack(np.broadcast_arrays(x[:, None], y, z), axis=-1).reshape(-1, 3)
    masses = np.repeat(0.25 * MASS * weight, 4)
    modes = np.stack([_displacement(kind, f, points) for kind, f in fields], axis=-1)
    K = np.zeros((len(fields), len(fields)))
    for i, (kind, f) in enumerate(fields):
        for j, (other, g) in enumerate(fields):
            if kind == other:
                order = 2 if kind < 2 else 1
                density = f.deriv(order)(x) * g.deriv(order)(x)
                K[i, j] = (BENDING, BENDING, TWISTING, STRETCHING)[kind] * LENGTH * weight @ density
    stiffness, basis = eigh(K, np.einsum("n,nai,naj->ij", masses, modes, modes))
    modes = modes @ basis
    tip = np.array([[LENGTH, 0.0, 0.0]])
    Phi = np.stack([_displacement(kind, f, tip)[0] for kind, f in fields], axis=-1) @ basis
    Psi = np.stack([_turn(kind, f) for kind, f in fields], axis=-1) @ basis
    S = np.einsum("n,naj,nbk->jkab", masses, modes, modes)
    invariants = Invariants(
        mass=float(masses.sum()),
        s=masses @ points,
        Z=np.einsum("n,na,nb->ab", masses, points, points),
        M=np.einsum("jkaa->jk", S),
        M3=np.einsum("n,naj->ja", masses, modes),
        M4=np.einsum("n,na,nbj->jab", masses, points, modes),
        S=S,
    )
    none = np.zeros((3, len(fields)))
    markers = (Marker(np.zeros(3), STILL, none, none), Marker(tip[0], STILL, Phi, Psi))
    return ReducedBody(invariants, stiffness, np.diag(2.0 * ratio * np.sqrt(stiffness)), markers)


def _displacement(kind, f, points):
    """Displacement of points, shape [n, 3], of bending along y or z, a twist or a stretch by f(x)."""
    x, y, z = points.T
    zero = 0.0 * x
    fields = (
        (-y * f.deriv()(x), f(x), zero),
        (-z * f.deriv()(x), zero, f(x)),
        (zero, -z * f(x), y * f(x)),
        (f(x), zero, zero),
    )
    return np.stack(fields[kind], axis=1)


def _turn(kind, f):
    """Turn of the tip, shape [3]."""
    slope = f.deriv()(LENGTH)
    return np.array([(0.0, 0.0, slope), (0.0, -slope, 0.0), (f(LENGTH), 0.0, 0.0), (0.0, 0.0, 0.0)][kind])


def gantry(beams, non_rotating, gravity=9.81, hinged=False, **options):
    """A carriage that slides along x on one that slides along y, and a chain of beams on it that ends in a tool.

    Args:
        beams: How each beam lies on what carries it, quaternions.
        non_rotating: Names of the bodies that are marked as non-rotating: Bridge, Trolley, Beam0.., Tool.
        hinged: Whether the trolley turns about z instead of sliding.
        options: Of `beam`.

    Returns:
        The compiled model.
    """
    heavy, small = (
        MassProperties(2.0, np.zeros(3), 0.02 * np.eye(3)),
        MassProperties(0.2, np.zeros(3), 1e-4 * np.eye(3)),
    )
    names = ["Bridge", "Trolley", *(f"Beam{k}" for k in range(len(beams))), "Tool"]
    rest = Frame(np.zeros(3), STILL)
    bodies = tuple(
        Body(f"/G/{name}", rest, small if name == "Tool" else heavy, non_rotating=name in non_rotating)
        for name in names
    )

    def at(x=0.0, rotation=STILL):
        return Frame(np.array([x, 0.0, 0.0]), rotation)

    second = ("revolute", STILL) if hinged else ("prismatic", Z_TO_Y)
    joints = [
        Joint("/G/X", "prismatic", -1, 0, at(0.0, Z_TO_X), at(0.0, Z_TO_X)),
        Joint("/G/Y", second[0], 0, 1, at(0.0, second[1]), at(0.0, second[1])),
    ]
    for k, rotation in enumerate([*beams, STILL]):
        joints.append(Joint(f"/G/J{k}", "fixed", 1 + k, 2 + k, at(LENGTH if k else 0.0, rotation), at()))
    motors = (Motor(0, "/G/X", "linear", linear=True), Motor(1, "/G/Y", "linear", linear=not hinged))
    target = Target("/G/Tool/tip", len(names) - 1, at(0.05))
    character = Character("/G", bodies, tuple(joints), motors, (target,), np.array([0.0, 0.0, -gravity]))
    tree = span_tree(character)
    flexible = beam(**options) if beams else None
    reduced = [
        flexible if "Beam" in body.path else rigid_body(body, anchors)
        for body, anchors in zip(character.bodies, body_anchors(character, tree), strict=True)
    ]
    return compile_model(character, tree, reduced)


def drive(times, reach):
    """Motor values and rates, shape [T, 2] each: from rest, both at once."""
    w = np.array([5.0, 7.0])
    phase = np.outer(times, w)
    return reach * (1.0 - np.cos(phase)), reach * w * np.sin(phase)
