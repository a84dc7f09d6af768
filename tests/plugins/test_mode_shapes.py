"""Mode shapes as files."""

import csv
from dataclasses import replace

import meshio
import numpy as np
import pytest
from calmotion.model import FEMeshes
from calmotion.model.outputs import ModeShapes
from calmotion.model.run import OutputPaths, RunSettings, Source
from calmotion.simulation import flexible_modes
from calmotion.testing import host_with, small_shot
from calmotion_plugins.mode_shapes.writing import write_modes


@pytest.fixture(scope="module")
def run(repository_folder, tmp_path_factory):
    folder = tmp_path_factory.mktemp("modes")
    plugins = repository_folder / "plugins"
    host = host_with(plugins / "fe_mesher", plugins / "mode_shapes")
    character, animation = small_shot(flexible=True)
    source = Source("shot.usda", "inspect", RunSettings(tolerance=1e-7))
    run = host.run([character, animation, source, OutputPaths(modes=str(folder))], [ModeShapes])
    outcomes = {result.idname: (result.outcome, result.error) for result in run}
    assert outcomes["modes.write"][0] == "done", outcomes
    return folder, run.get(ModeShapes), character, run.get(FEMeshes)


@pytest.fixture(scope="module")
def repository_folder():
    from pathlib import Path

    return Path(__file__).parents[2]


def test_each_flexible_body_gets_its_files_and_all_one_table(run):
    folder, shapes, character, _ = run
    flexible = [body for body in character.bodies if body.flexible]
    names = sorted(path.name for path in folder.iterdir())
    assert len(names) == 2 * len(flexible) + 1 and "modes.csv" in names
    assert sorted(shapes.paths) == sorted(str(folder / name) for name in names)
    for name in names:
        if name.endswith(".png"):
            assert (folder / name).read_bytes()[:4] == b"\x89PNG"


def test_the_table_has_frequencies_damping_and_effective_masses(run):
    folder, _, character, _ = run
    with open(folder / "modes.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    (body,) = {row["body"] for row in rows}
    material = next(b for b in character.bodies if b.path == body).flexible.material
    frequencies = [float(row["frequency_hz"]) for row in rows]
    assert frequencies == sorted(frequencies) and frequencies[0] > 0.0
    assert np.allclose([float(row["damping_ratio"]) for row in rows], material.damping_ratio)
    for axis in "xyz":
        total = sum(float(row[f"mass_{axis}_kg"]) for row in rows)
        assert 0.0 <= total < float(rows[0]["mass_kg"])
    # bending carries most of the mass across a slender link
    assert max(sum(float(row[f"mass_{axis}_kg"]) for row in rows) for axis in "yz") > 0.5 * float(rows[0]["mass_kg"])


def test_the_vtk_file_has_quadratic_elements_of_the_right_order_and_a_field_for_each_mode(run):
    folder, _, _, _ = run
    mesh = meshio.read(next(folder.glob("*.vtu")))
    (block,) = mesh.cells
    assert block.type == "tetra10"
    corners = mesh.points[block.data[:, :4]]
    # VTK: midpoints of 01, 12, 02, 03, 13, 23
    for column, (i, j) in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]):
        assert np.allclose(mesh.points[block.data[:, 4 + column]], 0.5 * (corners[:, i] + corners[:, j]), atol=1e-7)
    size = np.linalg.norm(np.ptp(mesh.points, axis=0))
    assert list(mesh.point_data)[0] == "mode_01"
    for field in mesh.point_data.values():
        assert np.linalg.norm(field, axis=1).max() == pytest.approx(0.1 * size, rel=1e-6)


def test_without_requested_modes_it_does_not_run(repository_folder):
    host = host_with(repository_folder / "plugins" / "mode_shapes")
    poll = host.operators["modes.write"].poll
    assert "--modes" in poll({OutputPaths: OutputPaths()})
    character, _ = small_shot()
    assert "flexible" in poll({type(character): character})


def test_bodies_of_like_names_have_files_of_their_own_also_where_capitals_make_no_difference(run, tmp_path):
    _, _, character, meshes = run
    ((body, linear),) = flexible_modes(character, meshes, None, 1e-3)
    paths = ("/Arm/Link", "/Arm/link", "/Other/LINK", "/Arm_link", "/arm_link")
    modes = [(replace(body, path=path), linear) for path in paths]
    written = write_modes(str(tmp_path), modes, total=len(modes), dpi=30, pictures=1)
    assert len({name.casefold() for name in written}) == len(written) == 2 * len(paths) + 1
