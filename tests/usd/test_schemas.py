"""The codeless schemas: generated, found, registered in time."""

import os
import subprocess
import sys
from pathlib import Path

import pxr
import pytest
from calmotion.usd import schemas

FOLDER = Path(schemas.plugin_path())

APPLY = """
from calmotion.usd import schemas
schemas.register(); schemas.register()
from pxr import Usd, UsdGeom, UsdPhysics
stage = Usd.Stage.CreateInMemory()
prim = UsdPhysics.RevoluteJoint.Define(stage, "/joint").GetPrim()
assert prim.ApplyAPI("CalmMotorAPI") and prim.HasAPI("CalmMotorAPI")
assert prim.GetAttribute("calm:motor:maxTorque").Get() == float("inf")
assert prim.GetAttribute("calm:motor:optimize").Get() is True
body = UsdGeom.Xform.Define(stage, "/body").GetPrim()
for name in schemas.NAMES:
    assert body.ApplyAPI(name), name
values = {a.GetName(): a.Get() for a in body.GetAttributes()}
expected = {
    "calm:flexible:enabled": True, "calm:flexible:modeCount": -1, "calm:flexible:maxFrequency": -1.0,
    "calm:flexible:elementSize": -1.0, "calm:flexible:interfaceRadius": -1.0, "calm:flexible:elasticity": "auto",
    "calm:flexible:geometry": "auto", "calm:flexible:wallThickness": -1.0,
    "calm:flexible:infill": -1.0, "calm:flexible:perimeters": -1, "calm:flexible:section": "auto",
    "calm:flexible:meshFile": None, "calm:damping:rayleighMass": None, "calm:damping:rayleighStiffness": None,
    "calm:motor:maxVelocity": float("inf"), "calm:motor:maxAcceleration": float("inf"),
    "calm:motor:maxJerk": float("inf"), "calm:motor:skelJoint": None,
    "calm:target:positionWeight": 1.0, "calm:target:rotationWeight": 0.0, "calm:retarget:reference": "rigid",
    "calm:retarget:endpoints": "free", "calm:retarget:cyclic": False, "calm:retarget:tolerance": -1.0,
    "calm:retarget:goal": -1.0,
}
for name, value in expected.items():
    assert name in values and values[name] == value, (name, values.get(name))
assert abs(values["calm:damping:ratio"] - 0.01) < 1e-9
print("fine")
"""

LATE = """
from pxr import Usd, UsdGeom
UsdGeom.Xform.Define(Usd.Stage.CreateInMemory(), "/used")
from calmotion import ShotError
from calmotion.usd import schemas
try:
    schemas.register()
except ShotError as error:
    print("refused", error.remedy)
"""


def run_python(code: str, repository: Path) -> str:
    environment = os.environ | {"PYTHONPATH": str(repository / "pipeline")}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_fresh_process_applies_the_schemas_and_sees_their_fallbacks(repository):
    assert run_python(APPLY, repository).strip() == "fine"


def test_registering_after_usd_was_used_is_refused_with_a_remedy(repository):
    printed = run_python(LATE, repository)
    assert printed.startswith("refused") and "register()" in printed and "PXR_PLUGINPATH_NAME" in printed


def test_what_is_committed_is_what_usdgenschema_makes(tmp_path):
    # the wheel of USD 26.5 has no sources of the schemas that ours inherit from
    if next(Path(pxr.__file__).parent.rglob("schema.usda"), None) is None:
        pytest.skip("this wheel of USD has no schema.usda, which usdGenSchema reads")
    command = [sys.executable, "-m", "pxr.Usd.usdGenSchema", str(FOLDER / "schema.usda"), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    places = {"@PLUG_INFO_LIBRARY_PATH@": "", "@PLUG_INFO_RESOURCE_PATH@": ".", "@PLUG_INFO_ROOT@": "."}
    for name in ("generatedSchema.usda", "plugInfo.json"):
        made = (tmp_path / name).read_text()
        for placeholder, value in places.items():
            made = made.replace(placeholder, value)
        assert made == (FOLDER / name).read_text(), f"{name} differs: generate it again"


ALONE = """
import sys
from pxr import Usd, UsdPhysics, UsdValidation
stage = Usd.Stage.CreateInMemory()
joint = UsdPhysics.RevoluteJoint.Define(stage, "/joint").GetPrim()
assert joint.ApplyAPI("CalmMotorAPI") and joint.HasAPI("CalmMotorAPI")
assert joint.GetAttribute("calm:motor:maxTorque").Get() == float("inf")
assert joint.GetAttribute("calm:motor:skelPose").Get() == "rest"
assert list(joint.GetAttribute("calm:motor:skelPose").GetMetadata("allowedTokens")) == ["rest", "start"]
assert "calmotion" not in sys.modules
shot = Usd.Stage.Open(sys.argv[1])
registry = UsdValidation.ValidationRegistry()
found = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators()).Validate(shot)
print([error.GetMessage() for error in found])
target = next(
    prim for prim in shot.Traverse() if prim.HasAPI("CalmTargetAPI"))
assert target.GetAttribute("calm:target:rotationWeight").IsDefined()
"""


def test_usd_without_calmotion_finds_the_schemas_by_the_search_path(repository):
    """As usdview and other applications use them: without any code of ours."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | {"PXR_PLUGINPATH_NAME": str(FOLDER)}
    shot = repository / "samples" / "bartender" / "bartender.usda"
    command = [sys.executable, "-c", ALONE, str(shot)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]", "the sample is valid under USD's own validators"
