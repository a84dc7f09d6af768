"""Finite-element meshes of the flexible bodies, and what these are made of: a printed part, an assembly."""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a body, such as an insert or a shell, with its own material.

    Attributes:
        path: Prim path of its surface.
        material: Prim path of its material.
        points: Of its surface [m], shape [n, 3], body frame.
        triangles: Shape [m, 3], outward; nearly closed is enough.
        modulus: Its Young's modulus over that of the material of the body.
        density: Its density over that of the material of the body.
        damping: Its fraction of critical damping.
    """

    path: str
    material: str
    points: np.ndarray
    triangles: np.ndarray
    modulus: float
    density: float
    damping: float


LINE_WIDTH = 0.45e-3  # of a printed line by a nozzle of 0.4 mm, as slicers set it [m]
PERIMETERS = 2  # of a print whose shot does not tell


@dataclass(frozen=True)
class Core:
    """What is inside the skin of a printed part, homogenised.

    Attributes:
        skin: Thickness of the solid skin [m].
        infill: Share of the core that is material; its density over that of the skin.
        stiffness: Its Young's modulus over that of the skin; Poisson's ratio is the same.
    """

    skin: float
    infill: float
    stiffness: float


def core_of(infill: float, skin: float) -> Core:
    """The core of a print.

    Args:
        infill: Share of the core that is material, between 0 and 1, exclusively.
        skin: Thickness of its skin [m].

    Source: the Hashin-Shtrikman bound of isotropic plane lattices, E = E_s f / (3 - 2 f), in Bendsoe and Sigmund 1999,
    Material interpolation schemes in topology optimization; triangulated lattices reach it (f / 3 at low densities:
    Gibson and Ashby 1997, Cellular Solids). Patterns that bend are softer, down to f^2 of open foams.
    """
    return Core(skin, infill, infill / (3.0 - 2.0 * infill))


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
        deflection_error: Estimated relative error of deflections, to which stiff modes add little; None: twice that of
            frequencies.
        error_of_source: Relative error of the compliance, since the solid is not that of the body's visual surface.
        factor_of_source: Of the stiffness of that surface over that of the solid.
    """

    min_dihedral_deg: float
    volume: float
    volume_error: float
    repairs: tuple[str, ...] = ()
    frequency_error: float | None = None
    stiffness_factor: float = 1.0
    source: str = ""
    deflection_error: float | None = None
    error_of_source: float = 0.0
    factor_of_source: float = 1.0

    @property
    def factor(self) -> float:
        """By which the elements are softer than the material."""
        return self.stiffness_factor * self.factor_of_source

    @property
    def error_of_solid(self) -> float:
        """Relative error of the stiffness by that of the solid; that of a rod goes with its section squared."""
        return 2.0 * abs(self.volume_error) + self.error_of_source


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
