"""Masses that a shot states, and those of the solids that carry them."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.mesh.mass import balance_note, mass_of_solid
from calmotion.model.character import Body, ElasticMaterial, FlexibleSettings, Frame
from trimesh.creation import box

SETTINGS = FlexibleSettings(ElasticMaterial("/Abs", 2e9, 0.35, 1050.0, 0.01))
BAR = box((0.3, 0.02, 0.02))
OWN = mass_of_solid(BAR.vertices, BAR.faces, 1050.0)
TURNS = np.sqrt((0.3**2 + 2.0 * 0.02**2) / 12.0)  # its radius of gyration [m]


@pytest.mark.parametrize(
    ("moved", "larger", "told"),
    [
        (0.0, 1.0, ""),
        (0.005, 1.2, ""),
        (0.09, 1.0, "the centre is 90 mm from"),
        (0.0, 4.0, f"{1e3 * TURNS:.3g} instead of {2e3 * TURNS:.3g} mm"),
        (0.0, 0.25, f"{1e3 * TURNS:.3g} instead of {5e2 * TURNS:.3g} mm"),
    ],
)
def test_a_balance_that_the_solid_does_not_have_is_told(moved, larger, told):
    """A servo at one end, or heavy ends, of a bar whose mass is spread evenly."""
    stated = replace(OWN, center=OWN.center + [moved, 0.0, 0.0], inertia=larger * OWN.inertia)
    body = Body("/Bar", Frame(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])), stated, flexible=SETTINGS)
    notes = balance_note(body, OWN)
    assert (len(notes) == 1 and told in notes[0]) if told else not notes
    assert not balance_note(replace(body, flexible=None), OWN) and not balance_note(replace(body, mass=None), OWN)
