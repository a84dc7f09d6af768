"""The geometry of a body: triangulated surfaces in its frame, tetrahedra, and the solids for its mass."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.mesh.moments import Moments, is_closed, surface_moments
from calmotion.model import SurfaceMesh, TetGeometry
from calmotion.usd import gf
from calmotion.usd.reading.animated import moves_on_body
from calmotion.usd.reading.bodies import primitives
from calmotion.usd.reading.bodies.polygons import triangulate
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_below
from calmotion.usd.schemas import is_applied
from calmotion.usd.transforms import Pose

MESH = "Mesh"
_ROUNDED = ("catmullClark", "loop")  # schemes of subdivision that move points


@dataclass(frozen=True, eq=False)
class Shape:
    """One geometric prim of a body.

    Attributes:
        prim: The Usd.Prim.
        surface: Its surface, in the body's frame, m.
        moments: Moments of its solid, in the body's frame, m; None for an open surface.
        collider: Whether it collides.
    """

    prim: Any
    surface: SurfaceMesh
    moments: Moments | None
    collider: bool


def shapes_of(reading: Reading, body_prim: Usd.Prim, pose: Pose) -> list[Shape]:
    """The geometry below a body, up to bodies nested in it.

    Args:
        pose: Its pose, stage units.

    Raises:
        ShotError: Geometry that is not finite or whose faces do not fit its points.
    """
    shapes: list[Shape] = []
    purposes = _shown_purposes(body_prim)
    for prim in prims_below(body_prim, _is_elsewhere):
        if prim.GetTypeName() == "PointInstancer":
            _refuse_or_note_instances(reading, prim, body_prim)
        kind = str(prim.GetTypeName())
        if kind == MESH:
            points, triangles = mesh_geometry(prim, reading.start)
            moments = None
        elif kind in primitives.TYPES:
            points, triangles, moments = primitives.solid(prim, reading.start)
        else:
            continue
        if len(triangles) == 0:
            continue
        linear, offset = to_body(reading, prim, pose)
        placed = points @ linear.T + offset
        if np.linalg.det(linear) < 0.0:
            triangles = triangles[:, ::-1].copy()
        if moments is not None:
            moments = moments.mapped(linear, offset)
        elif is_closed(triangles, placed):
            moments = surface_moments(placed, triangles)
        writable = kind == MESH and not prim.IsInstanceProxy()
        surface = SurfaceMesh(
            path=str(prim.GetPath()),
            points=placed,
            triangles=triangles,
            color=color_of(prim, reading.start),
            visible=_is_visible(prim, reading.start, purposes) and not _is_copy(placed, triangles, shapes),
            displaced=len(placed) if writable else 0,
        )
        collider = is_applied(prim, "PhysicsCollisionAPI")
        collider = collider and prim.GetAttribute("physics:collisionEnabled").Get() is not False
        shapes.append(Shape(prim, surface, moments, collider))
    return shapes


def note_unread_shape(reading: Reading, shapes: list[Shape]) -> None:
    """Note what changes the shape of a flexible body in a viewer and not in a simulation: subdivision, animation."""
    for prim in (shape.prim for shape in shapes):
        path, scheme, points = prim.GetPath(), prim.GetAttribute("subdivisionScheme"), prim.GetAttribute("points")
        if scheme and scheme.HasAuthoredValue() and scheme.Get() in _ROUNDED:
            reading.note(
                f"{path}: its subdivision ({scheme.Get()}) is not applied: the body has the shape of its points"
            )
        if (points and points.ValueMightBeTimeVarying()) or moves_on_body(prim):
            reading.note(f"{path}: it is animated on its body; its shape and place at the first frame are used")


def tets_of(reading: Reading, body_prim: Usd.Prim, pose: Pose) -> TetGeometry | None:
    """The tetrahedra authored below a body, or None.

    Raises:
        ShotError: Several TetMesh prims, or one whose tetrahedra do not fit its points.
    """
    tet_meshes = [p for p in prims_below(body_prim, _is_elsewhere) if p.GetTypeName() == "TetMesh"]
    if not tet_meshes:
        return None
    if len(tet_meshes) > 1:
        raise ShotError(
            "a body has one TetMesh",
            path=body_prim.GetPath(),
            found=", ".join(str(p.GetPath()) for p in tet_meshes),
            remedy="Merge them into one, or keep one of them",
        )
    prim = tet_meshes[0]
    points = finite_points(prim, reading.start)
    tets = gf.indices(prim.GetAttribute("tetVertexIndices").Get(reading.start), 4)
    if len(tets) == 0 or len(points) == 0:
        raise ShotError(
            "has no tetrahedra",
            path=prim.GetPath(),
            attribute="tetVertexIndices",
            remedy="Author them, or remove the prim",
        )
    _check_indices(prim, "tetVertexIndices", tets, len(points))
    linear, offset = to_body(reading, prim, pose)
    mirrored = np.linalg.det(linear) < 0.0
    if mirrored != (prim.GetAttribute("orientation").Get() == "leftHanded"):
        tets = tets[:, [1, 0, 2, 3]].copy()
    return TetGeometry(str(prim.GetPath()), points @ linear.T + offset, tets)


def _is_elsewhere(prim: Usd.Prim) -> bool:
    """Whether what is below a prim is no geometry of the body above it: another body, patterns of instances, or a
    mark (a site of MuJoCo)."""
    return is_rigid_body(prim) or _is_mark(prim) or prim.GetParent().GetTypeName() == "PointInstancer"


def _is_mark(prim: Usd.Prim) -> bool:
    return is_applied(prim, "MjcSiteAPI")


def _refuse_or_note_instances(reading: Reading, prim: Usd.Prim, body_prim: Usd.Prim) -> None:
    """Point instances are not read: a ShotError for a flexible body, a note for a rigid one."""
    flexible = is_applied(body_prim, "CalmFlexibleBodyAPI")
    if flexible and body_prim.GetAttribute("calm:flexible:enabled").Get() is not False:
        raise ShotError(
            "holds point instances, which are not read as geometry of a flexible body",
            path=prim.GetPath(),
            found="PointInstancer",
            remedy="Make them Mesh prims or instanceable references, or move them out of the body",
        )
    reading.note(f"{prim.GetPath()}: point instances are not read; the body is used without them")


def to_body(reading: Reading, prim: Usd.Prim, pose: Pose) -> tuple[Array, Array]:
    """Linear part [3, 3] and offset [3] from a prim's own axes, stage units, to the body's frame, m."""
    world = reading.world_matrix(prim)
    scale = reading.units.length(1.0)
    return scale * pose.rotation.T @ world[:3, :3], scale * pose.rotation.T @ (world[:3, 3] - pose.position)


def finite_points(prim: Usd.Prim, time: float) -> Array:
    """The points of a Mesh or TetMesh, its own axes and stage units, shape [n, 3].

    Raises:
        ShotError: They are not finite.
    """
    points = gf.points(prim.GetAttribute("points").Get(time))
    if not np.all(np.isfinite(points)):
        raise ShotError(
            "its points are not finite", path=prim.GetPath(), attribute="points", remedy="Correct the points"
        )
    return points


def _check_indices(prim: Usd.Prim, name: str, found: IntArray, count: int) -> None:
    if len(found) and (int(found.min()) < 0 or int(found.max()) >= count):
        raise ShotError(
            f"refers to points that do not exist (the prim has {count})",
            path=prim.GetPath(),
            attribute=name,
            found=int(found.min()) if found.min() < 0 else int(found.max()),
            remedy="Correct the indices",
        )


def mesh_geometry(prim: Usd.Prim, time: float) -> tuple[Array, IntArray]:
    """Points and right-handed triangles of a Mesh, its polygons cut up, its holes left out."""
    points = finite_points(prim, time)
    counts = gf.indices(prim.GetAttribute("faceVertexCounts").Get(time))
    corners = gf.indices(prim.GetAttribute("faceVertexIndices").Get(time))
    if int(counts.min(initial=0)) < 0 or int(counts.sum()) != len(corners):
        raise ShotError(
            "faceVertexCounts do not sum to the number of faceVertexIndices",
            path=prim.GetPath(),
            attribute="faceVertexCounts",
            found=f"{int(counts.sum())} and {len(corners)}",
            remedy="Correct faceVertexCounts or faceVertexIndices",
        )
    _check_indices(prim, "faceVertexIndices", corners, len(points))
    keep = np.ones(len(counts), dtype=bool)
    holes = gf.indices(prim.GetAttribute("holeIndices").Get(time))
    keep[holes[(holes >= 0) & (holes < len(counts))]] = False
    triangles = triangulate(points, counts, corners, keep)
    if prim.GetAttribute("orientation").Get() == "leftHanded":
        triangles = triangles[:, ::-1].copy()
    return points, triangles


def _shown_purposes(body_prim: Usd.Prim) -> set[str]:
    """Purposes of the geometry by which a body is shown: guides and proxies where it has nothing else."""
    geometry = [p for p in prims_below(body_prim, _is_elsewhere) if p.IsA(UsdGeom.Gprim)]
    purposes = {str(UsdGeom.Imageable(prim).ComputePurpose()) for prim in geometry}
    return purposes - {"guide", "proxy"} or purposes


def _is_visible(prim: Usd.Prim, time: float, purposes: set[str]) -> bool:
    image = UsdGeom.Imageable(prim)
    return str(image.ComputePurpose()) in purposes and image.ComputeVisibility(time) != UsdGeom.Tokens.invisible


def _is_copy(points: Array, triangles: IntArray, earlier: list[Shape]) -> bool:
    """Whether a visible surface with the same points is there already, as converters make for collisions."""
    size = float(np.max(np.ptp(points, axis=0)))
    for shape in earlier:
        other = shape.surface
        if other.visible and other.points.shape == points.shape and len(other.triangles) == len(triangles):
            if np.allclose(other.points, points, rtol=0.0, atol=1e-6 * size):
                return True
    return False


def color_of(prim: Usd.Prim, time: float) -> tuple[float, float, float] | None:
    """The display colour, else the diffuse colour of a preview surface; linear RGB."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayColor")
    if primvar and primvar.HasValue() and str(primvar.GetTypeName()).endswith("3f[]"):
        values = gf.points(primvar.Get(time))
        if len(values):
            return tuple(float(x) for x in values[0])  # type: ignore[return-value]
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    if material:
        shader, _, _ = material.ComputeSurfaceSource()
        color = shader.GetInput("diffuseColor").Get() if shader and shader.GetInput("diffuseColor") else None
        if color is not None:
            return tuple(float(x) for x in color)  # type: ignore[return-value]
    return None
