"""Robots whose sizes, masses and inertias do not belong together, and those that do."""

import dataclasses

import numpy as np
import pytest
from calmotion.model import Character
from calmotion.usd.reading.context import Reading
from calmotion.usd.reading.plausibility import warn_of_units
from calmotion.usd.reading.shot import read_shot
from calmotion.usd.units import StageUnits
from pxr import Usd, UsdGeom
from small_shots import FORE, UPPER, make_flexible, write_arm


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return read_shot(str(write_arm(tmp_path_factory.mktemp("arm") / "arm.usda")))[0]


def warned(character: Character, meters=1.0, resting=()):
    """What is said of a robot whose stage has this unit."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageMetersPerUnit(stage, meters)
    reading = Reading(stage, StageUnits(meters, 1.0), 0.0)
    warn_of_units(reading, "/Arm", character, resting)
    assert reading.notes == [warning.message() for warning in reading.warnings], "a note in every run"
    return reading.warnings


def scaled(character: Character, length=1.0, mass=1.0, inertia=1.0, only=()):
    """A robot whose links have other sizes, masses and inertias."""
    bodies = []
    for body in character.bodies:
        if body.mass is not None and (not only or body.path in only):
            surfaces = tuple(dataclasses.replace(s, points=length * s.points) for s in body.surfaces)
            properties = dataclasses.replace(
                body.mass, mass=mass * body.mass.mass, center=length * body.mass.center,
                inertia=inertia * mass * length**2 * body.mass.inertia,
            )  # fmt: skip
            body = dataclasses.replace(body, surfaces=surfaces, mass=properties)
        bodies.append(body)
    return dataclasses.replace(character, bodies=tuple(bodies))


def test_a_robot_in_its_own_units_is_not_questioned(arm):
    assert warned(arm) == []


@pytest.mark.parametrize("mass", [0.3, 1.0, 3.0])
@pytest.mark.parametrize(("length", "meters"), [(0.1, 0.1), (0.01, 0.01), (0.001, 0.001)])
def test_metres_in_a_stage_of_a_smaller_unit_are_denser_than_any_solid(arm, mass, length, meters):
    (warning,) = warned(scaled(arm, length, mass), meters)
    assert "denser than any solid" in warning.problem and warning.attribute == "physics:mass"
    assert f"Lengths times {1.0 / length:g} would fit (metersPerUnit = 1)" in warning.remedy


@pytest.mark.parametrize(("length", "factor"), [(10.0, 0.1), (100.0, 0.01), (1000.0, 0.001)])
def test_decimetres_centimetres_and_millimetres_in_a_stage_in_metres_are_lighter_than_air(arm, length, factor):
    warnings = warned(scaled(arm, length))
    (warning,) = (warning for warning in warnings if "lighter than air" in warning.problem)
    assert f"Lengths times {factor:g} would fit (metersPerUnit = {factor:g})" in warning.remedy


@pytest.mark.parametrize(("mass", "problem", "factor"), [(1e3, "denser", "0.001"), (1e-3, "lighter than air", "1000")])
def test_grams_that_were_taken_for_kilograms_and_the_reverse_are_named_too(arm, mass, problem, factor):
    (warning,) = (warning for warning in warned(scaled(arm, mass=mass)) if problem in warning.problem)
    assert f"masses times {factor} (kilogramsPerUnit = {factor})" in warning.remedy


def test_one_link_whose_mesh_is_too_small_is_named(arm):
    (warning,) = warned(scaled(arm, 0.01, only=(FORE,)))
    assert warning.path == FORE and "more" not in warning.problem


@pytest.mark.parametrize(
    ("inertia", "factor"), [(1e4, "0.0001 (kg cm^2)"), (1e6, "1e-06 (kg mm^2)"), (1e7, "1e-07 (g cm^2)"),
                            (1e9, "1e-09 (g mm^2)"), (1e3, "0.001 (masses in grams)"),
                            (1e-3, "1000 (masses in kg"), (1e-4, "10000 (kg m^2 where the stage has centi"),
                            (1e-6, "1e+06 (kg m^2 where the stage has milli"), (1e-9, "1e+09 (")],
)  # fmt: skip
def test_inertias_of_another_size_than_the_link_are_told_with_their_unit(arm, inertia, factor):
    (warning,) = warned(scaled(arm, inertia=inertia, only=(UPPER,)))
    assert warning.path == UPPER and warning.attribute == "physics:diagonalInertia"
    assert f"Inertias times {factor}" in warning.remedy and "radius of gyration" in warning.found


def test_an_inertia_that_no_unit_makes_right_is_told_without_one(arm):
    (warning,) = warned(scaled(arm, inertia=70.0, only=(UPPER,)))
    assert "larger link" in warning.problem and warning.remedy.startswith("Correct it, unless")


@pytest.mark.parametrize("inertia", [0.05, 0.3, 3.0])
def test_inertias_of_odd_but_real_links_are_not_questioned(arm, inertia):
    assert warned(scaled(arm, inertia=inertia)) == []


@pytest.mark.parametrize(
    ("gravity", "meters", "right"), [(0.0981, 0.01, "981"), (981.0, 1.0, "9.81"), (9810.0, 1.0, "9.81"),
                                     (0.00981, 0.001, "9810"), (1.62, 1.0, ""), (0.0, 1.0, ""), (24.8, 1.0, "")],
)  # fmt: skip
def test_a_gravity_that_no_planet_has_is_told(arm, gravity, meters, right):
    warnings = warned(dataclasses.replace(arm, gravity=np.array([0.0, 0.0, -gravity])), meters)
    assert [warning.remedy.split("author ")[1] for warning in warnings] == ([right] if right else [])


MODULI = [
    (2.3, 1.0, "1e+09"), (766.0, 1.0, "1e+06"), (7e16, 1.0, "1e-06"), (2.1e13, 0.01, "0.01"), (2.1e14, 0.001, "0.001"),
    (210.0, 1.0, "1e+09"), (2.3e9, 1.0, ""), (3e4, 1.0, ""), (1.1e12, 1.0, ""),
]  # fmt: skip


@pytest.mark.parametrize(("modulus", "meters", "factor"), MODULI)
def test_a_modulus_that_no_solid_has_is_told_with_its_factor(tmp_path, modulus, meters, factor):
    arm = read_shot(str(write_arm(tmp_path / "arm.usda", make_flexible)))[0]
    fore = next(body for body in arm.bodies if body.path == FORE)
    material = dataclasses.replace(fore.flexible.material, youngs_modulus=modulus)
    fore = dataclasses.replace(fore, flexible=dataclasses.replace(fore.flexible, material=material))
    bodies = tuple(fore if body.path == FORE else body for body in arm.bodies)
    warnings = warned(dataclasses.replace(arm, bodies=bodies), meters)
    assert [warning.remedy.split(" ")[0] for warning in warnings] == ([factor] if factor else [])


def test_what_rests_stands_for_a_frame_or_has_no_geometry_is_not_questioned(arm):
    dense = scaled(arm, 0.01, only=(FORE,))
    assert warned(dense, resting=(FORE,)) == []
    assert warned(scaled(arm, mass=1e-6, only=(FORE,))) == []
    bodies = tuple(dataclasses.replace(body, surfaces=()) for body in dense.bodies)
    assert warned(dataclasses.replace(dense, bodies=bodies)) == []


@pytest.mark.parametrize(
    ("density", "factor", "right"),
    [
        (1.05e9, "1e-06", "1050"),
        (7.85e12, "1e-09", "7850"),
        (7.85, "1000", "7850"),
        (1.05, "1000", "1050"),
        (2.7e6, "0.001", "2700"),
    ],
)
def test_a_density_of_a_material_that_no_solid_has_is_told_with_its_factor(tmp_path, density, factor, right):
    arm = read_shot(str(write_arm(tmp_path / "arm.usda", make_flexible)))[0]
    fore = next(body for body in arm.bodies if body.path == FORE)
    assert fore.flexible is not None
    material = dataclasses.replace(fore.flexible.material, density=density)
    fore = dataclasses.replace(fore, mass=None, flexible=dataclasses.replace(fore.flexible, material=material))
    bodies = tuple(fore if body.path == FORE else body for body in arm.bodies)
    (warning,) = warned(dataclasses.replace(arm, bodies=bodies))
    assert warning.attribute == "physics:density" and warning.remedy == f"{factor} times that would be {right} kg/m^3"


def test_a_stage_without_metersperunit_is_told_what_usd_takes(tmp_path):
    path = write_arm(tmp_path / "arm.usda")
    text = path.read_text()
    (tmp_path / "none.usda").write_text(text.replace("    metersPerUnit = 1\n", ""))
    notes = read_shot(str(tmp_path / "none.usda"))[0].notes
    assert any("USD takes 0.01 m: the robot reaches 0.0" in note and "a factor of 100" in note for note in notes)
    assert any("denser than any solid" in note and "Lengths times 100" in note for note in notes)
    assert not any("metersPerUnit" in note for note in read_shot(str(path))[0].notes)
