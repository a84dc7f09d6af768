"""Matrices and frequencies of meshes that others computed, read where they are (the data's README has the sources)."""

import numpy as np
import pytest
from calmotion.mesh.tetrahedra import oriented_tets
from calmotion.model import ElasticMaterial
from calmotion.reduction.basis.natural_modes import clamped_modes, vector_mass
from calmotion.reduction.elements.assembly import assemble
from scipy.sparse import coo_matrix
from scipy.spatial import cKDTree

STEEL = ElasticMaterial("/block", 2e11, 0.3, 2900.0)


def read_deck(path):
    """Nodes [n, 3] and ten-node elements [m, 10], from 0, of an Abaqus deck."""
    rows, section = {"*node": [], "*element": []}, ""
    for line in path.read_text().splitlines():
        if line.startswith("*"):
            section = line.split(",")[0].strip().lower()
        elif section in rows:
            rows[section].append([float(x) for x in line.split(",")])
    return np.array(rows["*node"])[:, 1:], np.array(rows["*element"], dtype=int)[:, 1:] - 1


def read_matrix(path, n):
    data = np.loadtxt(path)
    rows, columns = data[:, 0].astype(int) - 1, data[:, 1].astype(int) - 1
    return coo_matrix((data[:, 2], (rows, columns)), shape=(n, n)).tocsr()


@pytest.fixture(scope="module")
def block(shared_data):
    """The Abaqus block of 257 nodes, our model of it, and which of our nodes is which of Abaqus'."""
    folder = shared_data / "fem" / "exudyn_abaqus"
    if not folder.is_dir():
        pytest.skip("no Abaqus decks here")
    nodes, elements = read_deck(folder / "blockC3D10.inp")
    corners, number = np.unique(elements[:, :4], return_inverse=True)
    points = nodes[corners]
    tets, turned = oriented_tets(points, number.reshape(-1, 4))
    assert turned == 0
    model = assemble(points, tets, STEEL)
    distance, ours = cKDTree(model.mesh.nodes).query(nodes)
    assert len(nodes) == len(model.mesh.nodes) == 257 and len(elements) == 122
    assert distance.max() < 1e-6  # straight edges: Abaqus' middle nodes are the midpoints
    return folder, model, ours


def test_the_stiffness_matrix_is_that_of_abaqus(block):
    folder, model, ours = block
    dofs = (3 * ours[:, None] + np.arange(3)).ravel()
    theirs = read_matrix(folder / "blockC3D10_STIF1.mtx", len(dofs))
    assert abs(model.stiffness[dofs][:, dofs] - theirs).max() < 1e-6 * abs(theirs).max()


def test_the_mass_matrix_is_that_of_abaqus(block):
    folder, model, ours = block
    dofs = (3 * ours[:, None] + np.arange(3)).ravel()
    theirs = read_matrix(folder / "blockC3D10_MASS1.mtx", len(dofs))
    assert theirs.sum() == pytest.approx(3.0 * model.mass.sum(), rel=1e-6)
    assert abs(vector_mass(model.mass)[dofs][:, dofs] - theirs).max() < 1e-6 * abs(theirs).max()


def test_the_clamped_block_has_the_known_frequencies(block):
    _, model, _ = block
    clamped = np.flatnonzero(model.mesh.nodes[:, 0] < 1e-6)
    assert clamped_modes(model, 3, clamped)[0] == pytest.approx([81.882, 81.946, 304.963], abs=2e-3)


def test_the_free_block_has_the_known_frequencies(block):
    _, model, _ = block
    assert clamped_modes(model, 3)[0] == pytest.approx([451.333, 452.010, 607.870], abs=2e-3)


def test_the_beams_of_scikit_fem_have_their_first_eigenvalue(shared_data):
    """Two beams joined by rods, 851 elements, clamped at the boundary `fixed`.

    Recorded as omega^2 = 50194.51; scikit-fem 12 itself gives 50194.94 on this file, and so do we.
    """
    path = shared_data / "fem" / "skfem" / "beams.msh"
    if not path.is_file():
        pytest.skip("no meshes of scikit-fem here")
    import meshio

    mesh = meshio.read(path, file_format="gmsh")
    tets, _ = oriented_tets(mesh.points, mesh.cells_dict["tetra"])
    assert len(tets) == 851
    fixed = mesh.cells_dict["triangle"][mesh.cell_data_dict["gmsh:physical"]["triangle"] == mesh.field_data["fixed"][0]]
    model = assemble(mesh.points, tets, ElasticMaterial("/beams", 200e9, 0.3, 8050.0))
    held = model.mesh.surface[np.isin(model.mesh.surface[:, :3], renumber(mesh, tets, fixed)).all(axis=1)]
    f = clamped_modes(model, 1, np.unique(held))[0]
    assert (2.0 * np.pi * f[0]) ** 2 == pytest.approx(50194.51, rel=2e-5)
    assert (2.0 * np.pi * f[0]) ** 2 == pytest.approx(50194.9444, rel=1e-7)


def renumber(mesh, tets, triangles):
    """Corner numbers of the model, which leaves out points that no element uses."""
    return np.searchsorted(np.unique(tets), np.unique(triangles))
