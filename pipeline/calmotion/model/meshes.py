"""Finite-element meshes of the flexible bodies."""

from __future__ import annotations

from dataclasses import dataclass

from calmotion.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class MeshQuality:
    """Quality measures of a tetrahedral mesh.

    Attributes:
        min_dihedral_deg: Smallest dihedral angle [deg].
        volume: [m^3].
        volume_error: Relative difference to the volume of the (repaired) input surface; 0 for authored tetrahedra.
        repairs: What was repaired, as sentences.
        frequency_error: Estimated relative error of the first frequencies; None where it is not known.
        source: What the body's solid was made of, such as `visual surface`.
        stiffness_factor: Of the stiffness of ever finer meshes over that of this one, by which its elements are softer.
    """

    min_dihedral_deg: float
    volume: float
    volume_error: float
    repairs: tuple[str, ...] = ()
    frequency_error: float | None = None
    stiffness_factor: float = 1.0
    source: str = ""


@dataclass(frozen=True, eq=False)
class CutPatch:
    """A part of the surface of a mesh to which a joint is attached, bounded by edges of the elements.

    Attributes:
        origin: Of the attachment frame [m], shape [3], body frame.
        triangles: Corners [m], shape [k, 3, 3]; elements may be refined within them.
    """

    origin: Array
    triangles: Array


@dataclass(frozen=True, eq=False)
class FEMesh:
    """Tetrahedra of one flexible body.

    Attributes:
        body: Body index.
        points: Corner points [m], shape [n, 3], body frame.
        tets: Shape [m, 4], int32, positive volumes.
        quality: Its quality measures.
        given: Whether the shot or the user chose its elements: nothing refines them then.
        patches: Interface patches along whose rims the elements are cut.
    """

    body: int
    points: Array
    tets: IntArray
    quality: MeshQuality
    given: bool = False
    patches: tuple[CutPatch, ...] = ()


@dataclass(frozen=True, eq=False)
class FEMeshes:
    """One mesh for each flexible body of the character, in the order of the bodies."""

    meshes: tuple[FEMesh, ...]
