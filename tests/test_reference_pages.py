"""The pages of the reference, the citation and the container file, against what they describe."""

import importlib.util
import json
import re
import shlex
import tomllib

import pytest
import yaml
from calmotion.cli.main import build_parser
from calmotion.version import __version__
from pxr import Sdf

# exponents of mass, length and time of each row of the table of units
DIMENSIONS = {
    "length, tolerance, element size": (0, 1, 0), "mass": (1, 0, 0), "Young's modulus": (1, -1, -2),
    "density": (1, -3, 0), "torque (`maxTorque`)": (1, 2, -2), "force of a prismatic motor": (1, 1, -2),
    "stiffness of a revolute drive": (1, 2, -2), "damping of a revolute drive": (1, 2, -1), "armature": (1, 2, 0),
    "speed of a motor": (0, 0, -1),
}  # fmt: skip
DEGREE = 3.14159265358979 / 180.0


def test_the_factors_between_units_follow_from_their_dimensions(repository):
    page = (repository / "docs" / "reference" / "schemas_head.txt").read_text()
    rows = [line.split("|")[1:-1] for line in page.splitlines() if line.startswith("| ")][2:]
    assert {row[0].strip() for row in rows} == set(DIMENSIONS)
    for name, _, *factors in ([cell.strip() for cell in row] for row in rows):
        mass, length, _ = DIMENSIONS[name]
        angle = DEGREE if "drive" in name else 1.0 / DEGREE if "speed" in name else 1.0
        for text, grams, units in zip(factors, (1, 1, 1000), (1, 100, 1000), strict=True):
            found = float(re.match(r"[\d.e+-]+", text)[0])
            assert found == pytest.approx(angle * grams**mass * units**length, rel=1e-3), (name, text)


def test_advice_on_attributes_is_about_attributes_there_are(repository):
    layer = Sdf.Layer.FindOrOpen(str(repository / "usd_schemas" / "calmotion" / "schema.usda"))
    there = {attribute.name for prim in layer.rootPrims for attribute in prim.attributes}
    advice = tomllib.loads((repository / "docs" / "reference" / "schema_use.toml").read_text())
    assert len(advice) > 40 and set(advice) <= there
    assert all(set(entry) == {"unit", "use"} and all(entry.values()) for entry in advice.values())


def test_the_page_of_schemas_has_units_defaults_and_advice(repository):
    path = repository / "docs" / "hooks" / "reference.py"
    spec = importlib.util.spec_from_file_location("reference_hook", path)
    hook = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hook)
    (row,) = [line for line in hook.schemas().splitlines() if line.startswith("| `calm:target:rotationWeight`")]
    assert row.split("|")[2:5] == [" float ", " m² (of rad²) ", " `0` "] and "0.05" in row


def test_every_file_that_names_the_version_names_this_one(repository):
    manifests = [*repository.glob("plugins/*/plugin.toml"), *repository.glob("plugins/*/blender_manifest.toml")]
    assert len(manifests) > 15
    named = {path.parent.name: tomllib.loads(path.read_text())["version"] for path in manifests}
    assert named == dict.fromkeys(named, __version__)
    release = re.search(r"^## (\d+\.\d+\.\d+)", (repository / "CHANGELOG.md").read_text(), re.MULTILINE)[1]
    assert release == __version__, "the newest release of CHANGELOG.md"


def test_every_file_that_names_versions_of_python_names_the_supported_ones(repository):
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    lowest, above = map(int, re.fullmatch(r">=3\.(\d+),<3\.(\d+)", project["requires-python"]).groups())
    supported = [f"3.{minor}" for minor in range(lowest, above)]
    classifiers = re.findall(r"Python :: (3\.\d+)", "\n".join(project["classifiers"]))
    assert classifiers == supported
    pages = ("README.md", "CONTRIBUTING.md", "Makefile", "docs/installation.md", "plugins/blender/README.md")
    for page in pages:
        assert f"Python {supported[0]} to {supported[-1]}" in (repository / page).read_text(), page
    text = (repository / "Makefile").read_text()
    assert set(re.findall(r"\bpython(3\.\d+)(?= (?:python|;))", text)) >= set(supported)
    doctor = (repository / "pipeline/calmotion/cli/commands/doctor.py").read_text()
    assert f"(3, {lowest}) <= sys.version_info[:2] < (3, {above})" in doctor
    container = re.search(r"^FROM (?:\S+/)?python:(\S+)-slim", (repository / "Containerfile").read_text(), re.MULTILINE)
    assert container[1] in supported


def test_the_citation_names_this_version_and_the_paper(repository):
    citation = yaml.safe_load((repository / "CITATION.cff").read_text())
    assert citation["cff-version"] == "1.2.0" and citation["version"] == __version__
    assert {"title", "message", "authors", "license"} <= set(citation)
    assert [author["family-names"] for author in citation["references"][0]["authors"]][0] == "Hoshyari"


def test_the_container_runs_commands_and_extras_there_are(repository):
    text = (repository / "Containerfile").read_text().replace("\\\n", "")
    command = json.loads(re.search(r"^CMD (\[.*\])$", text, re.MULTILINE)[1])
    assert build_parser().parse_args(command[1:]).output == "build"
    extras = tomllib.loads((repository / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(re.search(r"/opt/calmotion\[(.*?)\]", text)[1].split(",")) <= set(extras)
    for line in re.findall(r"^RUN (calmotion .*)$", text, re.MULTILINE):
        build_parser().parse_args(shlex.split(line)[1:])


def test_ten_questions_of_newcomers_are_answered_within_two_clicks(repository):
    """Each answer is a page, or a section of one, that the front page links to; the build checks the sections."""
    docs = repository / "docs"
    page = (docs / "index.md").read_text().split("## Questions of newcomers")[1].split("\n## ")[0]
    rows = [line.split("|")[1:3] for line in page.splitlines() if line.startswith("| ") and "?" in line]
    assert len(rows) >= 10
    generated = {"reference/schemas.md", "reference/commands.md", "reference/python.md"}
    for question, answer in rows:
        links = re.findall(r"\]\(([\w/.]+)", answer)
        assert links and all(link in generated or (docs / link).is_file() for link in links), question
