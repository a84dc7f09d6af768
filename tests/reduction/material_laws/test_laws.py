"""The choice of the elastic law, against simulations of the swung arm with each law."""

import re

import numpy as np
import pytest
from boxes import box_tets
from calmotion.errors import ShotError
from calmotion.model import ElasticMaterial, FlexibleSettings
from calmotion.reduction.basis import modal_derivatives as modal_derivatives_module
from calmotion.reduction.basis.craig_bampton import reduced_basis
from calmotion.reduction.basis.modal_derivatives import Support, modal_derivatives
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.reduction.material_laws import cubature
from calmotion.reduction.material_laws.deflection import MODES, deflection_of, deflection_under, work_of_loads
from calmotion.reduction.material_laws.laws import law_for, reduced_by_law

LENGTH, PAYLOAD = 0.6, 0.2


def arm(youngs_modulus):
    material = ElasticMaterial("/Looks/Plastic", youngs_modulus, 0.35, 1200.0)
    points, tets = box_tets((15, 1, 1), (LENGTH, 0.02, 0.02), (0.0, -0.01, -0.01))
    model = assemble(points, tets, material)
    x = model.mesh.nodes[:, 0]
    support = Support(np.flatnonzero(x < 1e-9), [np.flatnonzero(x > LENGTH - 1e-9)], [np.array([LENGTH, 0.0, 0.0])])
    settings = FlexibleSettings(material, mode_count=6)
    basis = reduced_basis(model, support.root, support.patches, support.centers, settings)
    return model, support, basis, material


def swing(speed):
    """Peak loads of a swing through 90 degrees in half a second over `speed`, the payload's included."""
    spin, turn = 5.89 * speed, 36.3 * speed**2
    force = PAYLOAD * LENGTH * np.array([[spin**2, 0.0, turn]])
    return LoadEnvelope(
        np.zeros(3), np.array([0.0, turn, 0.0]), np.array([0.0, spin, 0.0]), force, np.zeros((1, 3)), 5.0 * speed
    )


def choice(model, support, basis, material, loads, tolerance, path=""):
    """The law's name, its error [m], and the reason."""
    known = modal_derivatives(model, support, basis, min(MODES, len(basis.omega_squared)), material, "stvk")
    deflection = deflection_under(model, basis, known, material, loads, path)
    law = law_for(deflection, tolerance)
    return law.name, law.error_m(deflection), law.why(deflection)


def test_a_slow_swing_is_linear_and_a_fast_one_is_not():
    body = arm(1.8e9)
    slow, fast = choice(*body, swing(0.2), 1e-3), choice(*body, swing(1.0), 1e-3)
    assert slow[0] == "linear" and slow[1] < 1e-3
    assert fast[0] == "stvk" and "mm" in fast[2]
    # 31 mm bend and 0.95 mm of shortening, as published; loads at their peaks together make it more, not less
    assert 1e-3 < choice(*body, swing(1.0), 1.0)[1] < 30e-3
    # the same swing with a tolerance that allows it
    assert choice(*body, swing(1.0), 1.0)[0] == "linear"


def by_law(monkeypatch, **limits):
    """An arm of soft rubber that swings fast, reduced with other limits."""
    for name, value in limits.items():
        monkeypatch.setattr(*LIMITS[name], value)
    model, support, basis, material = arm(1.6e7)
    settings = FlexibleSettings(material)
    return reduced_by_law(model, support, basis, settings, swing(1.0), 1e-3, "/Arm/Link")


LIMITS = {"derivatives": (modal_derivatives_module, "MOST"), "cubature": (cubature, "_MOST_COORDINATES")}


def test_a_law_that_cannot_be_evaluated_gives_way_to_the_next_one_with_its_error(monkeypatch):
    found = by_law(monkeypatch, cubature=3)
    row = next(row for row in found.told if "linear material" in row.what)
    assert found.elasticity.law == "stvk" and row.estimated_error_m > 1e-3
    model, support, basis, material = arm(1.6e7)
    asked = FlexibleSettings(material, elasticity="neohookean")
    with pytest.raises(ShotError, match="accurate enough"):
        reduced_by_law(model, support, basis, asked, swing(1.0), 1e-3, "/Arm/Link")


def test_a_body_that_deflects_in_more_ways_than_there_is_room_for_is_told(monkeypatch):
    few = by_law(monkeypatch, cubature=3, derivatives=2)
    row = next(row for row in few.told if "the most there are" in row.what)
    assert row.estimated_error_m > 1e-3 and few.limit_m >= row.estimated_error_m
    every = by_law(monkeypatch, cubature=3, derivatives=40)
    assert every.limit_m == 0.0 and len(every.basis.omega_squared) > len(few.basis.omega_squared)


def test_rubber_needs_the_material_law():
    assert choice(*arm(1.6e7), swing(1.0), 1e-3)[0] == "neohookean"


def test_a_body_that_hangs_like_a_rope_is_refused_with_the_least_modulus():
    with pytest.raises(ShotError, match="too soft for this shot") as refused:
        choice(*arm(5e6), swing(1.0), 1e-3, "/Arm")
    least = float(re.search(r"author (\S+) Pa or more", refused.value.remedy)[1])
    assert choice(*arm(1.05 * least), swing(1.0), 1e-3)[0] == "neohookean"
    with pytest.raises(ShotError):
        choice(*arm(0.9 * least), swing(1.0), 1e-3)


def test_at_rest_everything_is_linear():
    still = LoadEnvelope(np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((1, 3)), np.zeros((1, 3)))
    assert choice(*arm(1e6), still, 1e-6)[:2] == ("linear", 0.0)


def test_a_deflection_is_bounded_by_twice_that_of_a_beam_at_rest_and_a_little_more():
    model, _, basis, _ = arm(1.8e9)
    none = np.zeros(3)
    loads = LoadEnvelope(none, none, none, np.array([[0.0, 0.0, 2.0]]), np.zeros((1, 3)))
    at_rest = 2.0 * LENGTH**3 / (3.0 * 1.8e9 * 0.02**4 / 12.0)
    assert 2.0 * at_rest < deflection_of(model, basis, loads) < 3.0 * at_rest


def test_the_work_of_loads_is_that_of_their_sum_at_worst():
    model, _, basis, _ = arm(1.8e9)
    rng = np.random.default_rng(0)
    loads = LoadEnvelope(
        *(rng.uniform(0.0, 2.0, 3) for _ in range(3)), *(rng.uniform(0.0, 2.0, (1, 3)) for _ in range(2))
    )
    bound = work_of_loads(model, basis.modes, basis.patch_motion, loads)
    X = model.mesh.nodes
    largest = np.zeros(len(bound))
    for _ in range(200):
        a, turn, w, force, moment = (
            value * rng.choice([-1.0, 1.0], value.shape)
            for value in (
                loads.acceleration, loads.angular_acceleration, loads.angular_velocity, loads.force, loads.moment
            )
        )  # fmt: skip
        field = a + np.cross(turn, X) + np.cross(w, np.cross(w, X))
        work = np.einsum("nak,na->k", basis.modes, model.mass @ field)
        work += np.einsum("pa,pak->k", np.concatenate([force, moment], axis=1), basis.patch_motion)
        largest = np.maximum(largest, np.abs(work))
    assert (largest <= bound * (1 + 1e-12)).all()
    assert largest == pytest.approx(bound, rel=0.35)


def test_the_reason_has_the_deflection_the_error_and_the_strain():
    body, number = arm(1.8e9), r"[0-9.]+(e-[0-9]+)? mm"
    linear = rf"its deflection is about {number}; a linear law would have an error of about {number}"
    assert re.fullmatch(linear, choice(*body, swing(0.2), 1e-3)[2])
    assert re.fullmatch(rf"{linear}; its strain is [0-9.]+%", choice(*body, swing(1.0), 1e-3)[2])
