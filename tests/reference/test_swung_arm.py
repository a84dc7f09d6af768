"""The unreduced arm and beam against beam theory, an ANCF beam and published spin-up values."""

import numpy as np
import pytest
from beams import pushed_beam
from spin_up import EA, EI, LARGEST, PER_LENGTH, PUBLISHED
from spin_up import LENGTH as LONG
from spin_up import angle as spin_up
from swung_arm import LENGTH, THICKNESS, SwungArm, quintic

E, AREA, SECOND = 1.8e9, THICKNESS**2, THICKNESS**4 / 12.0


def theory(force, poissons_ratio):
    shear = 10.0 * (1.0 + poissons_ratio) / (12.0 + 11.0 * poissons_ratio) * E / (2.0 * (1.0 + poissons_ratio))
    return pushed_beam(force, LENGTH, E * AREA, shear * AREA, E * SECOND)


def test_its_frequencies():
    """Clamped frequencies by beam theory: 11.04 Hz bare and 5.626 Hz with the cube."""
    assert SwungArm(payload=0.0).frequencies(1)[0] == pytest.approx(11.04, rel=3e-3)
    assert SwungArm().frequencies(1)[0] == pytest.approx(5.626, rel=3e-3)


@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_a_transverse_load_at_the_end_deflects_it_as_in_theory(law):
    """A static deflection of 30.64 mm, and six to eight times as much, where the end rotates by some thirty degrees."""
    arm = SwungArm(law=law, cells=(40, 1, 1), payload=0.0, poissons_ratio=0.0)
    for force, deflection, slope in ((10.235, 30.64e-3, 4.4), (75.0, 0.2, 29.5)):
        along, across, turned = theory(force, 0.0)
        assert across == pytest.approx(deflection, rel=0.01) and np.degrees(turned) == pytest.approx(slope, rel=0.02)
        assert arm.pushed(force, steps=5) == pytest.approx((along, across, turned), rel=0.01)


def test_it_sags_under_its_own_weight():
    """Beam theory: rho g A L^4 / 8 E I = 14.715 mm, and rho g L^2 / 2 k G more by shear (k = 5/6); nu = 0."""
    beam = SwungArm(1e8, cells=(20, 2, 2), payload=0.0, poissons_ratio=0.0, density=1000.0, length=1.0, thickness=0.1)
    bending, shear = 14.715e-3, 1000.0 * 9.81 / (2.0 * 5.0 / 6.0 * 0.5e8)
    for part in (0.01, 1.0):
        weight = (beam.full.mass @ np.tile([0.0, 0.0, -9.81 * part], len(beam.full.nodes))).reshape(-1, 3)
        sag = -(beam.full.statics(beam.root, weight, steps=1) - beam.full.nodes)[beam.tip, 2]
        assert sag == pytest.approx(part * (bending + shear), rel=2e-3)


def test_it_is_swung():
    """Deflection of 30.96 mm and shortening of 0.95 mm by an ANCF beam; this coarse mesh is 2% too stiff."""
    arm = SwungArm(cells=(16, 1, 1))
    _, tip = arm.swing(quintic(np.pi / 2, 0.5), 1.0 / 200.0, 0.42)
    stiffness = (arm.frequencies(1)[0] / 5.626) ** 2
    assert 1.005 < stiffness < 1.04
    assert np.abs(tip[:, 1]).max() == pytest.approx(30.96e-3 / stiffness, rel=0.01)
    assert LENGTH - tip[:, 0].min() == pytest.approx(0.95e-3 / stiffness**2, rel=0.02)


@pytest.mark.long
def test_it_is_swung_as_far_as_published():
    arm = SwungArm(cells=(30, 2, 2))
    _, tip = arm.swing(quintic(np.pi / 2, 0.5), 1.0 / 600.0, 0.45)
    assert np.abs(tip[:, 1]).max() == pytest.approx(30.96e-3, rel=2e-3)
    assert LENGTH - tip[:, 0].min() == pytest.approx(0.95e-3, rel=5e-3)


def spun(cells, step, duration=18.0):
    thickness = np.sqrt(12.0 * EI / EA)
    area = thickness**2
    beam = SwungArm(
        EA / area, cells=cells, payload=0.0, poissons_ratio=0.0, density=PER_LENGTH / area, length=LONG,
        thickness=thickness,
    )  # fmt: skip
    return beam.swing(spin_up, step, duration)


def test_it_is_spun_up():
    """Tip displacement of the spin-up of Simo and Vu-Quoc."""
    t, tip = spun((20, 1, 1), 1.0 / 60.0)
    for time, value in PUBLISHED.items():
        assert np.interp(time, t, tip[:, 1]) == pytest.approx(value, rel=0.006)
    assert tip[:, 1].min() == pytest.approx(LARGEST, rel=0.002)
    k = 6.0 * LONG * np.sqrt(PER_LENGTH / EA)
    stretched = LONG * (np.tan(k) / k - 1.0)
    assert stretched == pytest.approx(5.143e-4, rel=1e-3)
    # the wobble of some 3.6 mm across that is left is worth a micrometre of it
    assert (tip[t > 16.0, 0] - LONG).mean() == pytest.approx(stretched, rel=5e-3)


@pytest.mark.long
def test_it_is_spun_up_as_published():
    t, tip = spun((40, 1, 1), 1.0 / 240.0)
    for time, value in PUBLISHED.items():
        assert np.interp(time, t, tip[:, 1]) == pytest.approx(value, rel=0.004)
    assert tip[:, 1].min() == pytest.approx(LARGEST, rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("law", ["stvk", "neohookean"])
def test_a_soft_arm_is_swung_by_thirty_degrees(law):
    """What the nonlinear basis is held against: converged in the step to a tenth of what that has to meet."""
    arm = SwungArm(4e8, law, (12, 1, 1))
    move = quintic(np.pi / 2, 0.5)
    t, tip, slope = arm.swing_with_slope(move, 1.0 / 480.0, 0.7)
    _, finer = arm.swing(move, 1.0 / 960.0, 0.7)
    assert 29.0 < np.degrees(np.abs(slope).max()) < 35.0
    assert np.abs(tip - finer[::2]).max() < 2e-3 * np.abs(finer[:, 1]).max()
