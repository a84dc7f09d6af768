"""Patches from named surfaces."""

import numpy as np
import pytest
from beams import timoshenko_frequencies
from boxes import box_tets
from calmotion.errors import ShotError
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches
from calmotion.mesh.patches.named_patch import named_patch
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.model import ElasticMaterial, Frame, InterfaceSurface
from calmotion.reduction.basis.natural_modes import clamped_modes
from calmotion.reduction.elements.assembly import assemble

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def square(x0, x1, y0, y1, z, up=True):
    """Two triangles of a horizontal rectangle."""
    a, b, c, d = np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]], dtype=float)
    triangles = np.array([[a, b, c], [a, c, d]])
    return triangles if up else triangles[:, ::-1]


@pytest.fixture(scope="module")
def plate():
    return quadratic_mesh(*box_tets((10, 10, 1), (0.2, 0.2, 0.001)))


def attachment(path, position, triangles=None):
    surface = None if triangles is None else InterfaceSurface(f"{path}/part", path, triangles)
    return AttachmentFrame(path, Frame(np.asarray(position, dtype=float), IDENTITY), "interface", surface)


def test_nodes_on_the_surface_and_on_its_side_of_a_thin_wall(plate):
    nodes = named_patch(plate, square(0.0, 0.1, 0.0, 0.2, 0.001))
    x = plate.nodes[nodes]
    # 11 x 21 nodes of the upper side, those on the rim of the plate included
    assert len(nodes) == 11 * 21 and np.allclose(x[:, 2], 0.001) and x[:, 0].max() < 0.1 + 1e-9
    assert np.allclose(plate.nodes[named_patch(plate, square(0.0, 0.1, 0.0, 0.2, 0.0, up=False))][:, 2], 0.0)


def test_a_surface_a_little_off_the_mesh_is_found(plate):
    assert len(named_patch(plate, square(0.0, 0.1, 0.0, 0.2, 0.0015))) == 11 * 21
    assert len(named_patch(plate, square(0.0, 0.1, 0.0, 0.2, 0.004))) == 0


def test_named_patches_come_first_and_the_others_get_the_rest(plate):
    a = attachment("/J/a", (0.0, 0.1, 0.0), square(0.0, 0.04, 0.0, 0.2, 0.001))
    b = attachment("/J/b", (0.06, 0.1, 0.001))
    first, second = interface_patches(plate, [a, b], 0.05, "/Plate")
    assert len(first.nodes) == 5 * 21 and first.attachments == (0,)
    assert not np.intersect1d(first.nodes, second.nodes).size and len(second.nodes)


def test_two_names_at_one_place_stay_two(plate):
    a = attachment("/J/a", (0.1, 0.1, 0.0), square(0.0, 0.04, 0.0, 0.2, 0.001))
    b = attachment("/J/b", (0.1, 0.1, 0.0), square(0.16, 0.2, 0.0, 0.2, 0.001))
    assert len(interface_patches(plate, [a, b], -1.0, "/Plate")) == 2


def test_too_small_and_overlapping_ones_are_refused(plate):
    tiny = attachment("/J/a", (0.1, 0.1, 0.0), square(0.103, 0.107, 0.103, 0.107, 0.001))
    with pytest.raises(ShotError, match="too small") as caught:
        interface_patches(plate, [tiny], -1.0, "/Plate")
    assert caught.value.path == "/J/a/part"
    one = attachment("/J/a", (0.0, 0.1, 0.0), square(0.0, 0.1, 0.0, 0.2, 0.001))
    other = attachment("/J/b", (0.2, 0.1, 0.0), square(0.08, 0.2, 0.0, 0.2, 0.001))
    with pytest.raises(ShotError, match="overlaps"):
        interface_patches(plate, [one, other], -1.0, "/Plate")


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize("ratio", [1.0, 0.19, 0.01])
def test_a_strip_is_clamped_on_the_whole_of_its_end_however_thin(named, ratio):
    """The first bending frequencies both ways are within 1% of Timoshenko's beam, by a named end face and by itself.

    Without lateral contraction the solid is a beam.
    """
    width, length = 0.025, 0.4
    thickness = ratio * width
    steel = ElasticMaterial("/Looks/Steel", 1.93e11, 0.0, 7850.0)
    model = assemble(*box_tets((80, 4, 1), (length, width, thickness)), steel)
    a, b, c, d = np.array([[0.0, y, z] for y, z in ((0.0, 0.0), (0.0, thickness), (width, thickness), (width, 0.0))])
    end = np.array([[a, b, c], [a, c, d]])
    joint = attachment("/J/hub", (0.0, 0.5 * width, 0.5 * thickness), end if named else None)
    (patch,) = interface_patches(model.mesh, [joint], -1.0, "/Strip")
    assert np.array_equal(patch.nodes, np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9))
    f = clamped_modes(model, 12, patch.nodes)[0]
    for height in (thickness, width):
        (theory,) = timoshenko_frequencies(steel, length, height, 1)
        assert np.abs(f / theory - 1.0).min() < 0.01
