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
        stiffness_factor: Of the stiffness of a finer mesh over that of this one, by which its elements are softer.
        interface_factors: Static stiffness of its p moving interfaces that a finer mesh has: the inverse of its own,
            without the factor above, times that of the finer one, shape [6p, 6p]; None where that is not known.
        interface_softest: The same of the least stiffness that its estimated error allows.
        element_error: Estimated relative error of the compliance of its elements, without the factors above.
        shape_error: What of the first frequencies may be wrong, besides `frequency_error`, since the mesh leaves its
            surface in places.
    """

    min_dihedral_deg: float
    volume: float
    volume_error: float
    repairs: tuple[str, ...] = ()
    frequency_error: float | None = None
    stiffness_factor: float = 1.0
    source: str = ""
    interface_factors: Array | None = None
    interface_softest: Array | None = None
    element_error: float = 0.0
    shape_error: float = 0.0

    @property
    def error(self) -> float | None:
        """Relative error of the first frequencies, that by the shape included; None where it is not known."""
        return None if self.frequency_error is None else self.frequency_error + self.shape_error


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
class MissingVolume:
    """What a mesh leaves out of the solid that it was made for, near its boundary.

    Attributes:
        points: Places on its boundary [m], shape [q, 3], body frame.
        volumes: What is missing there [m^3], shape [q]; negative: what is too much.
    """

    points: Array
    volumes: Array


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
        missing: What it leaves out of its solid; None: nothing, or it is not known.
    """

    body: int
    points: Array
    tets: IntArray
    quality: MeshQuality
    given: bool = False
    patches: tuple[CutPatch, ...] = ()
    missing: MissingVolume | None = None


@dataclass(frozen=True, eq=False)
class FEMeshes:
    """One mesh for each flexible body of the character, in the order of the bodies."""

    meshes: tuple[FEMesh, ...]
