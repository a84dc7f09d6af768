"""A square plate with known answers; elements as they get finer, and as the material gets stiff in volume."""

import numpy as np
import pytest
from boxes import box_tets
from calmotion.model import ElasticMaterial
from calmotion.reduction.basis.natural_modes import SparseSolver, clamped_modes, vector_mass
from calmotion.reduction.elements.assembly import assemble

SIDE, THICKNESS = 1.0, 0.02
STEEL = ElasticMaterial("/Looks/Steel", 2.1e11, 0.3, 7850.0)
BENDING = STEEL.youngs_modulus * THICKNESS**3 / (12.0 * (1.0 - STEEL.poissons_ratio**2))
# omega a^2 sqrt(rho h / D) of a thin square plate held along one side: Leissa, Vibration of Plates, 1969
CANTILEVER = np.array([3.4917, 8.5246, 21.429, 27.331, 31.111])
CLAMPED = 0.00126532  # middle deflection D / (q a^4) of a thin square plate held all around: Taylor, Govindjee 2004


def respond(model, held, load):
    """Static displacement, shape [n, 3]."""
    n = len(model.mesh.nodes)
    dofs = np.flatnonzero(np.repeat(~np.isin(np.arange(n), held), 3))
    u = np.zeros(3 * n)
    u[dofs] = SparseSolver(model.stiffness[dofs][:, dofs]).solve(load.ravel()[dofs])
    return u.reshape(n, 3)


def test_frequencies_of_a_cantilevered_plate():
    model = assemble(*box_tets((20, 20, 1), (SIDE, SIDE, THICKNESS)), STEEL)
    f = clamped_modes(model, 5, np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9))[0]
    found = 2.0 * np.pi * f * SIDE**2 * np.sqrt(STEEL.density * THICKNESS / BENDING)
    # rotary inertia and shear, which the thin plate has not, take half a percent off the higher ones at 50 to 1
    assert found[:2] == pytest.approx(CANTILEVER[:2], rel=5e-3)
    assert found == pytest.approx(CANTILEVER, rel=1e-2)


def test_deflection_of_a_clamped_plate():
    """A quarter of it, by symmetry; extrapolated from two meshes at the order of the element."""
    found = []
    for cells in (8, 12):
        half = SIDE / 2
        model = assemble(*box_tets((cells, cells, 1), (half, half, THICKNESS)), STEEL)
        X = model.mesh.nodes
        n = len(X)
        fixed = np.zeros((n, 3), dtype=bool)
        fixed[(X[:, 0] < 1e-9) | (X[:, 1] < 1e-9)] = True
        fixed[X[:, 0] > half - 1e-9, 0] = True
        fixed[X[:, 1] > half - 1e-9, 1] = True
        free = np.flatnonzero(~fixed.ravel())
        load = (vector_mass(model.mass) @ np.tile([0.0, 0.0, -1.0], n))[free]
        u = np.zeros(3 * n)
        u[free] = SparseSolver(model.stiffness[free][:, free]).solve(load)
        middle = np.linalg.norm(X - [half, half, THICKNESS / 2], axis=1).argmin()
        found.append(-u[3 * middle + 2] * BENDING / (STEEL.density * THICKNESS * SIDE**4))
    assert abs(found[1] / CLAMPED - 1.0) < abs(found[0] / CLAMPED - 1.0)
    finest = found[1] + (found[1] - found[0]) / ((12 / 8) ** 4 - 1.0)
    # shear at 50 to 1 adds a little
    assert finest == pytest.approx(CLAMPED, rel=0.01)


def test_frequencies_converge_at_the_order_of_the_element():
    """Eigenvalues of a smooth problem (a free block) at order four, twice that of the displacements' gradients, from
    quadratic elements; near the corners of a coarse mesh it is a little less."""
    block = ElasticMaterial("/Looks/Block", 1.0, 0.3, 1.0)
    errors = []
    finest = clamped_modes(assemble(*box_tets((10, 6, 5), (1.0, 0.6, 0.5)), block), 2)[0] ** 2
    for n in (1, 2, 3):
        model = assemble(*box_tets((2 * n, n, n), (1.0, 0.6, 0.5)), block)
        errors.append(clamped_modes(model, 2)[0] ** 2 - finest)
    order = np.log(np.array(errors[1]) / errors[2]) / np.log(3 / 2)
    assert (np.array(errors) > 0.0).all()
    assert (order > 2.8).all()


@pytest.mark.parametrize("poissons_ratio", [0.3, 0.49, 0.499])
def test_a_nearly_incompressible_beam_does_not_lock(poissons_ratio):
    """Bending of a 10 to 1 beam with one and two elements across, against four: it converges as fast, from 1.5%.

    (With the volumetric strain taken as its mean over each element the beam is as much too soft.)
    """
    rubber = ElasticMaterial("/Looks/Rubber", 1e8, poissons_ratio, 1000.0)
    found = []
    for across in (1, 2, 4):
        model = assemble(*box_tets((10 * across, across, across), (1.0, 0.1, 0.1)), rubber)
        held = np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9)
        found.append(clamped_modes(model, 2, held)[0].mean())  # a pair: the beam is square
    coarse, fine = found[0] / found[2] - 1.0, found[1] / found[2] - 1.0
    assert 0.0 < fine < 0.02 and coarse > 3.5 * fine
