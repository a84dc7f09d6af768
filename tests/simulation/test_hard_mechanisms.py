"""Mechanisms at the edge of what can be simulated: they run and stay together, or are refused with a reason."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import FEMeshes, Frame
from calmotion.testing import beam_arm, quintic, shot_of
from four_bar import four_bar
from made_shots import simulated
from neutral_hinges import push_rod, truss, turning
from scipy.spatial.transform import Rotation

# pi^2 E I / (4 L^2 g) of the arm that `beam_arm` makes [kg]
EULER_LOAD = np.pi**2 * 1.8e9 * 0.02**4 / 12.0 / (4.0 * 0.6**2) / 9.81
NEUTRAL = {
    "balanced push rod": push_rod(),
    "push rod in a horizontal plane": push_rod((0.0, -9.81, 0.0)),
    "push rod without gravity": push_rod((0.0, 0.0, 0.0)),
    "truss without freedom": truss(),
    "wheel": turning(),
    "door": turning((0.0, -9.81, 0.0), 0.1),
    "pendulum without gravity": turning((0.0, 0.0, 0.0), 0.1),
}


@pytest.mark.parametrize("integrator", ["bdf2", "generalized-alpha"])
@pytest.mark.parametrize("name", NEUTRAL)
def test_rigid_mechanisms_whose_hinges_have_no_stiffness_do_what_they_should(name, integrator):
    """The truss jumped to another pose, with its tip below its feet, from the second step on."""
    run = simulated((NEUTRAL[name], FEMeshes(())), shot_of(quintic(0.8, 0.5, 0.2), 1.0), integrator=integrator)
    assert run.position_errors.max() < 1e-6


def linkage(tilt=0.0, driven=0, turn=1.0):
    """The four-bar with a hinge whose axis is tilted out of the plane [rad], driven at the crank or the rocker."""
    character, meshes = four_bar()
    joints = list(character.joints)
    frame = joints[3].frame0
    turned = Rotation.from_quat(np.roll(frame.rotation, -1)) * Rotation.from_rotvec([tilt, 0.0, 0.0])
    joints[3] = replace(joints[3], frame0=Frame(frame.position, np.roll(turned.as_quat(), 1)))
    motor = replace(character.motors[0], joint=driven, path=joints[driven].path)
    made = replace(character, joints=tuple(joints), motors=(motor,))
    return (made, meshes), shot_of(quintic(turn, 1.8), 2.0)


def test_a_linkage_that_is_driven_past_its_dead_centre_is_refused():
    """The failure of the rigid robot was looked at for deflections, which was a traceback."""
    with pytest.raises(ShotError, match="closed chains can reach") as refused:
        simulated(*linkage(driven=3, turn=3.0))
    assert "/Bars" in str(refused.value)


@pytest.mark.long
@pytest.mark.parametrize("driven, turn", [(0, 2.0 * np.pi), (3, 0.2)], ids=["a whole turn", "within its range"])
def test_a_linkage_passes_its_dead_centres(driven, turn):
    simulated(*linkage(driven=driven, turn=turn))


@pytest.mark.long
@pytest.mark.parametrize("tilt", [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.1])
def test_a_nearly_redundant_chain_runs_or_is_refused(tilt):
    try:
        simulated(*linkage(tilt))
    except ShotError as error:
        assert tilt > 1e-6 and "/Bars" in str(error)


@pytest.mark.long
@pytest.mark.parametrize("share, least, most", [(0.3, 0.0, 0.05), (0.8, 0.0, 0.12), (1.3, 0.2, 9.0), (4.0, 0.2, 9.0)])
def test_a_column_beyond_its_euler_load_falls_or_is_refused(share, least, most):
    character, meshes = beam_arm(payload=share * EULER_LOAD)
    column = replace(character, gravity=np.array([-9.81, 0.0, 0.0]))
    try:
        run = simulated((column, meshes), shot_of(quintic(0.01, 0.5), 3.0))
        assert least <= run.position_errors.max() <= most
    except ShotError as error:
        assert share > 1.0 and "/Arm/Link0" in str(error)
