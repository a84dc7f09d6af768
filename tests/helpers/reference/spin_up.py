"""The spin-up beam of Simo and Vu-Quoc (On the dynamics of flexible beams under large motions, 1986)."""

import numpy as np
from calmotion.model import ElasticMaterial
from turning_beam import TurningBeam

LENGTH, EA, EI, PER_LENGTH = 10.0, 2.8e7, 1.4e4, 1.2
SPIN, RISE = 6.0, 15.0
# transverse tip displacement at these times, and the largest [m]; Simo and Vu-Quoc 1986
PUBLISHED = {2.5: -0.1510, 5.0: -0.4683, 7.5: -0.5592, 10.0: -0.3632, 12.5: -0.1130}
LARGEST, LARGEST_AT = -0.5739, 6.76


def angle(t):
    k = 2.0 * np.pi / RISE
    return np.where(t < RISE, SPIN / RISE * (t * t / 2.0 + (np.cos(k * t) - 1.0) / k**2), SPIN * (t - RISE / 2.0))


def rate(t):
    k = 2.0 * np.pi / RISE
    return np.where(t < RISE, SPIN / RISE * (t - np.sin(k * t) / k), SPIN)


def beam(law, modes=8):
    thickness = np.sqrt(12.0 * EI / EA)
    area = thickness**2
    # no Poisson's ratio, as in a beam's theory
    material = ElasticMaterial("/Looks/Beam", EA / area, 0.0, PER_LENGTH / area, damping_ratio=0.0)
    return TurningBeam(LENGTH, thickness, material, (40, 1, 1), law, modes)
