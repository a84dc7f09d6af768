"""Materials of links: typical values of data sheets for solid parts."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """An isotropic material.

    Attributes:
        youngs_modulus: [Pa].
        poissons_ratio: [-].
        density: [kg/m^3].
        damping_ratio: Fraction of critical damping of each mode.
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float
    damping_ratio: float


MATERIALS = {
    "nylon": Material(1.7e9, 0.39, 1010.0, 0.02),
    "pla": Material(3.0e9, 0.36, 1240.0, 0.015),
    "abs": Material(2.1e9, 0.37, 1050.0, 0.02),
    "pom": Material(2.8e9, 0.37, 1410.0, 0.01),
    "polycarbonate": Material(2.3e9, 0.38, 1200.0, 0.01),
    "aluminium": Material(69e9, 0.33, 2700.0, 0.002),
}
