"""Materials, and the functions of `boxes`, for the tests of finite elements."""

import numpy as np
import pytest
from boxes import box_tets, conical_quadrature, fe_mesh
from calmotion.model import ElasticMaterial, Frame

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def frame(*position):
    return Frame(np.array(position, dtype=float), IDENTITY)


@pytest.fixture(scope="session")
def steel():
    return ElasticMaterial("/Looks/Steel", 2.1e11, 0.3, 7850.0)


@pytest.fixture(scope="session")
def plastic():
    """Of arms that are swung."""
    return ElasticMaterial("/Looks/Plastic", 1.8e9, 0.35, 1200.0)


@pytest.fixture(scope="session")
def helpers():
    """The functions of this file, for tests that cannot import it."""

    class Helpers:
        box = staticmethod(box_tets)
        quadrature = staticmethod(conical_quadrature)
        frame = staticmethod(frame)
        mesh = staticmethod(fe_mesh)

    return Helpers
