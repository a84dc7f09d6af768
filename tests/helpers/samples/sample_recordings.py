"""The recording of a run against its table."""

import csv

import numpy as np
from calmotion.usd.reading import read_shot
from recordings import read_recording


def table_of(path):
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    return {name: np.array([float(row[k]) for row in rows[1:]]) for k, name in enumerate(rows[0])}


def agree(columns, entity, times, values):
    found, scalars = columns[entity, "Scalars:scalars"]
    np.testing.assert_allclose(found, times, atol=2e-9)
    np.testing.assert_allclose(np.ravel(scalars), values, rtol=1e-9, atol=1e-9)


def check_written_curves(root_layer, table):
    """The motor curves of a written layer against those that the run simulated last, which its table holds."""
    (character, animation, _), table = read_shot(str(root_layer)), table_of(table)
    for motor, track in zip(character.motors, animation.current, strict=True):
        steps = np.searchsorted(table["time_s"], track.times - 1e-9)
        np.testing.assert_allclose(table["time_s"][steps], track.times, atol=1e-9)
        np.testing.assert_allclose(track.values, table[f"{motor.path}.output"][steps], atol=1e-6)


def check_recording(recording, table, shot, root):
    """The recording against the table of its run: `root` is the motion that the table holds."""
    columns, table = read_recording(recording), table_of(table)
    character, animation, _ = read_shot(str(shot))
    frames, times = animation.frame_times, table["time_s"]
    moving = set()
    for body in character.bodies:
        entity = f"/{root}{body.path}"
        for surface in body.surfaces:
            found, triangles = columns[f"/{root}{surface.path}", "Mesh3D:triangle_indices"]
            assert found is None and len(triangles) == 1, "each mesh once"
            found, shapes = columns[f"/{root}{surface.path}", "Mesh3D:vertex_positions"]
            assert len(shapes) == (len(frames) if body.flexible and found is not None else 1)
            moving |= {body.path} if body.flexible and found is not None else set()
        found, places = columns[entity, "Transform3D:translation"]
        assert found is None or np.allclose(found, frames, atol=2e-9)
        assert len(places) == (1 if found is None else len(frames))
    assert moving == {body.path for body in character.bodies if body.flexible}
    for target in character.targets:
        agree(columns, f"/errors/position_mm/{root}{target.path}", times, 1e3 * table[f"{target.path}.error"])
        if target.rotation_weight > 0.0:
            turns = np.degrees(table[f"{target.path}.rotation_error"])
            agree(columns, f"/errors/rotation_deg/{root}{target.path}", times, turns)
        trails = columns[f"/trails/{root}{target.path}", "LineStrips3D:strips"][1]
        places = np.stack([np.interp(frames, times, table[f"{target.path}.{axis}"]) for axis in "xyz"], axis=1)
        np.testing.assert_allclose(np.array([trail[-1][-1] for trail in trails]), places, atol=1e-5)
    for motor in character.motors:
        values, efforts = table[f"{motor.path}.output"], table[f"{motor.path}.effort"]
        agree(columns, f"/motors{motor.path}/angle_deg/{root}", times, np.degrees(values))
        agree(columns, f"/motors{motor.path}/torque_Nm/{root}", times, efforts)
    for joint in character.joints:
        for kind, unit in (("force", "N"), ("moment", "Nm")):
            size = np.linalg.norm([table[f"{joint.path}.{kind}.{axis}"] for axis in "xyz"], axis=0)
            agree(columns, f"/reactions/{kind}_{unit}{joint.path}/{root}", times, size)
    # bodies, their meshes and curves stand under their prims' paths, and nothing else does
    roots = {entity.split("/")[1] for entity, _ in columns if not entity.startswith("/__")}
    usual = {"input", "reference", "trails", "errors", "spectra", "motors", "reactions", "summary"}
    assert roots - {"optimized", "changes_deg", "optimizer", "scenery"} == usual
    return columns
