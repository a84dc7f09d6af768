"""What an inspection says of a body."""

import json
from dataclasses import replace

import numpy as np
import pytest
from calmotion.cli.reports.inspection import _solid_row
from calmotion.model import Body, ElasticMaterial, FEMesh, FlexibleSettings, Frame
from calmotion.model.meshes import MeshQuality, Part
from calmotion.workflow.inspection import _body
from one_hinge import ONE_HINGE

BODY = Body(
    "/Arm/fore", Frame(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])), None,
    flexible=FlexibleSettings(ElasticMaterial("/Looks/Plastic", 1.8e9, 0.35, 1200.0)),
)  # fmt: skip
QUALITY = MeshQuality(12.0, 8e-5, 2e-3, ("meshed the wrapped visual surface",), 0.013, 1.0, "wrapped visual surface")


def test_a_meshed_body_says_what_its_solid_is_made_of_and_how_good_its_mesh_is():
    report = _body(BODY, None, FEMesh(0, np.zeros((4, 3)), np.zeros((1, 4), np.int32), QUALITY), True)
    assert report["solid"] == "wrapped visual surface" and report["solid_notes"] == list(QUALITY.repairs)
    assert (report["volume_m3"], report["volume_error"], report["frequency_error"]) == (8e-5, 2e-3, 0.013)
    assert _solid_row(report) == ["/Arm/fore", "wrapped visual surface", "80 cm³", "1.3%"]
    unknown = replace(QUALITY, frequency_error=None)
    mesh = FEMesh(0, np.zeros((4, 3)), np.zeros((1, 4), np.int32), unknown)
    assert _solid_row(_body(BODY, None, mesh, True))[3] == "-"


def test_parts_have_their_own_materials():
    parts = tuple(
        Part(
            f"/Arm/fore/{name}", f"/Looks/{name}", np.zeros((0, 3)), np.zeros((0, 3), np.int32), modulus, density, 0.02
        )
        for name, modulus, density in (("shell", 1.0, 1.0), ("insert", 100.0, 6.5))
    )
    settings = BODY.flexible
    material = replace(settings.material, parts=parts)
    shell, insert = _body(replace(BODY, flexible=replace(settings, material=material)), None, None, True)["parts"]
    assert (shell["path"], shell["material"], shell["youngs_modulus_pa"]) == ("/Arm/fore/shell", "/Looks/shell", 1.8e9)
    assert (insert["youngs_modulus_pa"], insert["density_kg_m3"], insert["damping_ratio"]) == (1.8e11, 7800.0, 0.02)
    assert "parts" not in _body(BODY, None, None, True)


@pytest.mark.parametrize("body", [BODY, replace(BODY, flexible=None)])
def test_a_body_without_a_mesh_has_no_solid(body):
    assert "solid" not in _body(body, None, None, False)


def test_mode_shapes_of_a_rigid_robot_are_refused_with_the_reason(calmotion, tmp_path):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    done = calmotion("inspect", tmp_path / "shot.usda", "--modes", tmp_path / "modes", "--json", "--quiet")
    error = json.loads(done.stdout)["error"]
    assert done.returncode == 1 and "Write the mode shapes" in error["problem"]
    assert "nothing is flexible" in error["found"] and "there is no" not in error["found"] and error["remedy"]
