"""The corpus of damaged meshes: each is repaired with its volume kept, or refused for the right reason."""

import re

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh.repair import closed_solid as closed_solid_module
from calmotion.mesh.surfaces.closed_surfaces import boundary_walks
from calmotion.model import SurfaceMesh
from damaged_meshes import CORPUS


@pytest.fixture(scope="module")
def closed_solid():
    return closed_solid_module.closed_solid


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("name", CORPUS)
def test_a_damaged_mesh_is_repaired_or_refused(closed_solid, name):
    case = CORPUS[name]
    points, triangles = case.make()
    surface = SurfaceMesh("/Arm/link/mesh", points, triangles.astype(np.int32))
    if case.volume is None:
        with pytest.raises(ShotError, match=case.told) as caught:
            closed_solid([surface], "/Arm/link")
        assert caught.value.remedy and caught.value.path.startswith("/Arm/link")
        return
    made = closed_solid([surface], "/Arm/link")
    assert made.volume == pytest.approx(case.volume, rel=case.tolerance)
    assert boundary_walks(made.triangles) == []
    assert re.search(case.told, " ".join(made.repairs)), made.repairs
