"""What the volume that a mesh leaves out near its boundary changes about the body's stiffness and frequencies.

A thin layer on the boundary has the strains of the material below it. To first order it adds its own energy, so that
neither a finer mesh nor another one is needed to know how much stiffer, or how much faster, the true shape is.

Source: Hadamard's formula for the derivative of an eigenvalue by the shape (Sokolowski and Zolesio 1992, 3.3).
"""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.model.character import ElasticMaterial
from calmotion.model.meshes import MissingVolume
from calmotion.reduction.elements.elastic_forms import linear_stress
from calmotion.reduction.elements.embedding import embed

_AT_ONCE = 4000  # places whose strains are in memory


def shape_forms(
    mesh: QuadraticMesh, material: ElasticMaterial, missing: MissingVolume, u: Array
) -> tuple[Array, Array, Array]:
    """Stiffness and mass that the missing volume adds, for combinations of displacements.

    The skin of a printed part is what is missing; of a part that is made of several materials, the material of the
    body.

    Args:
        mesh: Straight-sided.
        material: Of the body.
        missing: What the mesh leaves out.
        u: Displacements [m], shape [n, 3, k].

    Returns:
        Symmetric, both of shape [k, k]: u_i^T dK u_j [J] and u_i^T dM u_j [kg m^2]; and the sum of the stiffness of
        all places, whether volume is missing there or too much, shape [k] [J].
    """
    from skfem.models.elasticity import lame_parameters

    lame, mu = lame_parameters(material.youngs_modulus, material.poissons_ratio)
    k = u.shape[2]
    stiffness, mass, whole = np.zeros((k, k)), np.zeros((k, k)), np.zeros(k)
    places = embed(mesh, missing.points)
    for first in range(0, len(missing.volumes), _AT_ONCE):
        some = slice(first, first + _AT_ONCE)
        volumes, local = missing.volumes[some], u[places.nodes[some]]
        gradient = np.einsum("qaj,qaik->kqij", places.gradients[some], local, optimize=True)
        stress = linear_stress(gradient, lame, mu)
        whole += np.einsum("kqij,kqij,q->k", stress, gradient, np.abs(volumes), optimize=True)
        stress *= volumes[:, None, None]
        stiffness += stress.reshape(k, -1) @ gradient.reshape(k, -1).T
        moved = np.einsum("qa,qaik->kqi", places.values[some], local, optimize=True)
        mass += material.density * ((moved * volumes[:, None]).reshape(k, -1) @ moved.reshape(k, -1).T)
    return 0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T), whole
