"""Mass, centre and inertia of a body with the precedence and the "not authored" conventions of UsdPhysics."""

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdShade
from scipy.spatial import ConvexHull, QhullError

from calmotion.arrays import Array
from calmotion.mesh.moments import Moments, sum_of, surface_moments
from calmotion.model import MassProperties
from calmotion.support.rotations import rotation_from_quaternion
from calmotion.usd import gf, schemas
from calmotion.usd.dialects import number_of
from calmotion.usd.reading.bodies.flexible import ELASTIC
from calmotion.usd.reading.bodies.primitives import TYPES
from calmotion.usd.reading.bodies.shapes import MESH, Shape
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_below
from calmotion.usd.schemas import is_applied
from calmotion.usd.transforms import Pose

_FOLLOWS = "Correct it, or remove the attribute so that it follows from the geometry"
_DEFAULT_DENSITY = 1000.0  # kg/m^3: what UsdPhysics assumes for a collider without any density


def mass_of(reading: Reading, prim: Usd.Prim, pose: Pose, shapes: list[Shape]) -> MassProperties | None:
    """The mass properties of a body.

    A mass on the body overrides everything below it. Otherwise each of its colliders (where it has none, or only
    visible solids state one, each of these) gives a mass: its own, or its volume times its own density, the body's, the
    material's, and for a collider at last 1000 kg/m^3. Centre and inertia follow from the geometry, and what is
    authored of them on the body overrides that.

    Args:
        pose: Its pose, stage units.

    Returns:
        SI, body frame; None where nothing in the shot gives the body a mass.

    Raises:
        ShotError: A mass or density that is authored and negative, or not finite; an inertia that is not positive.
    """
    units = reading.units
    mass = _authored(prim, "physics:mass")
    written = prim.GetAttribute("physics:mass")
    if mass is None and written and written.HasAuthoredValue():
        reading.note(
            f"{prim.GetPath()}: physics:mass is 0, which UsdPhysics reads as not authored: the mass follows from "
            "geometry and density"
        )
    center, tensor = _center(prim), _inertia(prim)
    if tensor is not None:
        _note_impossible_inertia(reading, prim, tensor)
    if mass is not None and center is not None and tensor is not None:
        return MassProperties(units.mass(mass), units.length(pose.scale * center), units.inertia(tensor))
    solid = _from_geometry(reading, prim, shapes, body_mass=None if mass is None else units.mass(mass))
    if solid is None:
        return None
    return MassProperties(
        solid.mass,
        solid.center if center is None else units.length(pose.scale * center),
        solid.inertia if tensor is None else units.inertia(tensor),
    )


def states_mass(prim: Usd.Prim, shapes: list[Shape]) -> bool:
    """Whether a mass or density is authored on a body, its solids, or a material of these that is not elastic; refuses
    one that is negative."""
    solids = _solids(prim, shapes)
    return any(map(_states, (prim, *(s.prim for s in solids)))) or any(
        _material_density(s.prim, elastic=False) is not None for s in solids
    )


def _solids(prim: Usd.Prim, shapes: list[Shape]) -> list[Shape]:
    """The geometry that gives a body its mass: its colliders, else what is visible. Visible geometry that states a mass
    or density counts in place of colliders of which nothing does."""
    colliders, visible = [s for s in shapes if s.collider], [s for s in shapes if s.surface.visible]
    stating = [s for s in visible if _states(s.prim)]
    if stating and not _states(prim) and not any(_states(s.prim) or _material_density(s.prim) for s in colliders):
        return stating
    return colliders or visible


def _states(prim: Usd.Prim) -> bool:
    return any(_authored(prim, f"physics:{what}") is not None for what in ("mass", "density"))


def _authored(prim: Usd.Prim, name: str) -> float | None:
    """A mass or density: None where not authored, or zero, which UsdPhysics reads as not authored."""
    return number_of(prim, name) or None


def _center(prim: Usd.Prim) -> Array | None:
    attribute = prim.GetAttribute("physics:centerOfMass")
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    if value is None:
        return None
    center = gf.vector(value)
    if np.all(np.isneginf(center)):
        return None
    finite = bool(np.all(np.isfinite(center)))
    schemas.require(finite, prim, "physics:centerOfMass", value, "the centre of mass is not finite", _FOLLOWS)
    return center


def _inertia(prim: Usd.Prim) -> Array | None:
    """The authored inertia tensor, body axes, stage units, shape [3, 3]."""
    attribute = prim.GetAttribute("physics:diagonalInertia")
    value = attribute.Get() if attribute and attribute.HasAuthoredValue() else None
    if value is None:
        return None
    diagonal = gf.vector(value)
    if np.all(diagonal == 0.0):
        return None
    schemas.require(
        bool(np.all(np.isfinite(diagonal)) and np.all(diagonal > 0.0)), prim, "physics:diagonalInertia", value,
        "every principal moment of inertia must be positive", _FOLLOWS,
    )  # fmt: skip
    axes = prim.GetAttribute("physics:principalAxes")
    turn = axes.Get() if axes and axes.HasAuthoredValue() else None
    quaternion = np.array([1.0, 0.0, 0.0, 0.0]) if turn is None else gf.quaternion(turn)
    finite = bool(np.all(np.isfinite(quaternion)))
    schemas.require(finite, prim, "physics:principalAxes", turn, "the principal axes are not finite")
    if np.linalg.norm(quaternion) < 1e-6:  # (0, 0, 0, 0) means: not authored
        return np.diag(diagonal)
    rotation = rotation_from_quaternion(quaternion)
    return rotation @ np.diag(diagonal) @ rotation.T


def _note_impossible_inertia(reading: Reading, prim: Usd.Prim, tensor: Array) -> None:
    a, b, c = np.sort(np.linalg.eigvalsh(tensor))
    if c > (a + b) * (1.0 + 1e-3):
        reading.note(
            f"{prim.GetPath()}: physics:diagonalInertia is physically impossible (its largest value exceeds the sum "
            "of the other two); it is used as authored"
        )


def _from_geometry(
    reading: Reading, prim: Usd.Prim, shapes: list[Shape], body_mass: float | None
) -> MassProperties | None:
    """Mass properties from geometry and densities, scaled to the authored mass of the body where there is one."""
    _note_unread_colliders(reading, prim)
    solids = _solids(prim, shapes)
    note_unread_masses(reading, prim, shapes)
    density = _authored(prim, "physics:density")
    parts: list[MassProperties] = []
    for shape in solids:
        separate = shape.prim != prim  # a body may itself be its only geometry
        part_density = _authored(shape.prim, "physics:density") if separate else None
        part_density = part_density or density or _material_density(shape.prim)
        part_mass = _authored(shape.prim, "physics:mass") if separate else None
        si = None if part_density is None else reading.units.density(part_density)
        if si is None and (shape.collider or body_mass is not None or part_mass is not None):
            si = _DEFAULT_DENSITY
            if body_mass is None and part_mass is None:
                reading.note(
                    f"{shape.surface.path}: neither a mass nor a density is authored; 1000 kg/m^3 is assumed, as "
                    "UsdPhysics does"
                )
        if si is None:
            continue
        moments = shape.moments or _hull_moments(reading, shape)
        part = moments.mass_properties(si)
        if part.mass <= 0.0:
            continue
        if part_mass is not None:
            factor = reading.units.mass(part_mass) / part.mass
            part = MassProperties(part.mass * factor, part.center, part.inertia * factor)
        parts.append(part)
    if parts:
        whole = sum_of(parts)
        if body_mass is None:
            return whole
        factor = body_mass / whole.mass
        return MassProperties(body_mass, whole.center, whole.inertia * factor)
    if body_mass is None:
        return None
    # A mass without geometry: a ball of the density of water, unless an inertia is authored.
    radius2 = (3.0 * body_mass / (4.0 * np.pi * _DEFAULT_DENSITY)) ** (2.0 / 3.0)
    if _center(prim) is None:
        reading.note(f"{prim.GetPath()}: it has neither a centre of mass nor geometry; its centre is at its origin")
    if _inertia(prim) is None:
        reading.note(
            f"{prim.GetPath()}: it has a mass but neither inertia nor geometry; the inertia of a ball of 1000 kg/m^3 "
            "is used"
        )
    return MassProperties(body_mass, np.zeros(3), 0.4 * body_mass * radius2 * np.eye(3))


def _note_unread_colliders(reading: Reading, prim: Usd.Prim) -> None:
    """Note colliders that give no mass because their geometry is of a type without a volume here."""
    for below in prims_below(prim, is_rigid_body):
        kind = str(below.GetTypeName())
        if below.IsA(UsdGeom.Gprim) and is_applied(below, "PhysicsCollisionAPI") and kind not in (MESH, *TYPES):
            reading.note(
                f"{below.GetPath()}: a collider of type {kind} gives no mass; author physics:mass on its body where it "
                "should count"
            )


def note_unread_masses(reading: Reading, prim: Usd.Prim, shapes: list[Shape]) -> None:
    """Note what PhysicsMassAPI says below a body and is not used: that of a group, centre and inertia of a collider."""
    solids = {shape.prim.GetPath() for shape in _solids(prim, shapes)}
    for below in prims_below(prim, is_rigid_body):
        if below == prim or not is_applied(below, "PhysicsMassAPI"):
            continue
        said: dict[str, Any] = {"physics:centerOfMass": _center(below), "physics:diagonalInertia": _inertia(below)}
        if below.GetPath() not in solids:
            said |= {name: _authored(below, name) for name in ("physics:mass", "physics:density")}
        for name in (name for name, value in said.items() if value is not None):
            reading.note(f"{below.GetPath()}: {name} is not used here; author it on the body, {prim.GetPath()}")


def _hull_moments(reading: Reading, shape: Shape) -> Moments:
    """Moments of the convex hull of an open surface."""
    points = shape.surface.points
    try:
        hull = ConvexHull(points)
    except QhullError:  # flat or too few points
        return Moments(0.0, np.zeros(3), np.zeros((3, 3)))
    reading.note(f"{shape.surface.path}: the surface is open; its mass follows from its convex hull")
    triangles = hull.simplices.astype(np.int32)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inward = np.einsum("na,na->n", np.cross(b - a, c - a), a - points.mean(axis=0)) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return surface_moments(points, triangles)


def _material_density(prim: Usd.Prim, elastic: bool = True) -> float | None:
    """The density of the physics material bound to a prim, the weakest opinion.

    Args:
        elastic: Also that of an elastic one, which flexible bodies have from their mesh.
    """
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")
    if not material or not is_applied(material.GetPrim(), "PhysicsMaterialAPI"):
        return None
    if not elastic and is_applied(material.GetPrim(), ELASTIC):
        return None
    return _authored(material.GetPrim(), "physics:density")
