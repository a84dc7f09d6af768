"""The study of which robots of a folder load."""

from __future__ import annotations

from calmotion.benchmarks.speed.reading import (
    IMPORTED,
    LOADS,
    REFUSED,
    Row,
    loaded_rows,
    page,
    study,
    without_folders,
)
from calmotion.benchmarks.speed.robot_files import descriptions_in, shots_in
from one_hinge import ONE_HINGE

ROBOT = '<mujoco><worldbody><body><joint name="a"/></body></worldbody></mujoco>'
SCENE = '<mujoco><include file="robot.xml"/><worldbody><geom type="plane" size="1 1 1"/></worldbody></mujoco>'
WITH_HAND = '<mujoco><include file="hand.xml"/><worldbody><body><joint name="b"/></body></worldbody></mujoco>'


def test_parts_and_scenes_are_no_robots(tmp_path):
    for name, text in (
        ("robot.xml", ROBOT), ("scene.xml", SCENE), ("arm.xml", WITH_HAND), ("hand.xml", ROBOT), ("x.xml", "<svg/>"),
        ("broken.xml", "<"), ("a/b.urdf", "<robot/>"),
    ):  # fmt: skip
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    found = [path.relative_to(tmp_path).as_posix() for path in descriptions_in(tmp_path)]
    assert found == ["a/b.urdf", "arm.xml", "robot.xml"]


def test_a_layer_that_another_opens_is_no_shot(tmp_path):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    (tmp_path / "root.usda").write_text("#usda 1.0\n(\n    subLayers = [@./shot.usda@]\n)\n")
    assert [path.name for path in shots_in(tmp_path)] == ["root.usda"]


def test_a_page_has_lines_to_run_and_reasons_and_is_read_again(tmp_path):
    (tmp_path / "a shot.usda").write_text(ONE_HINGE)
    (tmp_path / "broken.urdf").write_text("<robot")
    rows = list(study(tmp_path, imports=True))
    assert [(row.outcome, row.bodies, row.motors, row.targets, row.frames) for row in rows] == [
        (LOADS, 1, 1, 1, 25), (REFUSED, 0, 0, 0, 0),
    ]  # fmt: skip
    made = page(
        [*rows, Row("b.urdf", IMPORTED, 3, 2, 1, 1, 1.0, "", "calmotion import b.urdf -o c.usda")], ["`x`"], "do it"
    )
    assert "`calmotion optimize 'a shot.usda' -o calm.usda`" in made and "no XML file" in made and "    do it\n" in made
    known = loaded_rows(made)
    assert list(known) == ["a shot.usda", "b.urdf"] and known["b.urdf"].bodies == 3
    assert [row.reason for row in study(tmp_path, True, known)][0] == "known"


def test_reasons_name_no_folder_of_a_machine():
    text = 'cannot convert "/Geometry/head" from /home/me/a/head.obj (/tmp/x/.y-z/shot.usda); /arm/tmp/b.size'
    assert without_folders(text) == 'cannot convert "/Geometry/head" from head.obj (shot.usda); /arm/tmp/b.size'
