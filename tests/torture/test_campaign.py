"""The judges of the campaign see what they look for, and a short campaign is clean."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import events  # noqa: E402
import verdicts  # noqa: E402
from runs import Ending  # noqa: E402
from workspace import Workspace, empty  # noqa: E402

LAYER = '#usda 1.0\n(\n    doc = "x 1"\n)\ndef "A"\n{\n    float x = 1.25e-3\n}\n'


@pytest.fixture
def space(tmp_path):
    made = Workspace(tmp_path)
    for folder in (made.out, made.expected, made.cache, made.warm, made.temporary):
        empty(folder)
    for name in ("calm.usda", "calm_root.usda"):
        (made.expected / name).write_text(LAYER)
    (made.expected / "calm.csv").write_text("t,x\n0,1\n1,2\n2,4\n")
    (made.expected / "calm.rrd").write_bytes(b"RRF2" + bytes(20000))
    for path in made.expected.iterdir():
        (made.out / path.name).write_bytes(path.read_bytes())
    return made


def test_the_same_result_has_no_faults_and_any_difference_is_one(space):
    assert verdicts.result_faults(space, False) == [] and verdicts.leftovers(space) == []
    (space.out / "calm.usda").write_text(LAYER.replace("1.25e-3", "1.2500000001e-3"))
    assert verdicts.result_faults(space, False) == []
    for name, content, fault in (
        ("calm.usda", LAYER.replace("1.25e-3", "1.26e-3"), "differs"), ("calm.usda", LAYER[:-3], "half written"),
        ("calm.csv", "t,x\n0,1\n1,2\n2,4.1\n", "differs"), ("calm.csv", "t,x\n0,1\n1,2\n2", "half written"),
        ("calm.rrd", "RRF2", "half written"), ("calm.csv", None, "lost"),
    ):  # fmt: skip
        before = (space.expected / name).read_bytes()
        (space.out / name).write_text(content) if content is not None else (space.out / name).unlink()
        assert [text for text in verdicts.result_faults(space, False) if fault in text and name in text], (name, fault)
        (space.out / name).write_bytes(before)


def test_files_that_nothing_uses_are_left(space):
    for name in ("out/.calm.usda.checkpoint.npz", "tmp/x", "cache/meshes/.calmotion-1-2-x.npz"):
        (space.root / name).parent.mkdir(exist_ok=True)
        (space.root / name).write_text("")
    assert len(verdicts.leftovers(space)) == 3


@pytest.mark.parametrize(
    ("ending", "fault"),
    [
        (Ending(1, "", "error: no", 1.0), ""), (Ending(130, "", "", 1.0), ""), (Ending(2, '{"error": 1}', "", 1.0), ""),
        (Ending(1, "", "Traceback (most", 1.0), "traceback"), (Ending(None, "", "", 1.0), "stuck"),
        (Ending(-11, "", "", 1.0), "signal 11"), (Ending(3, "", "", 1.0), "exit status 3"),
        (Ending(1, "", "", 1.0), "without an error"),
    ],
)  # fmt: skip
def test_a_refusal_is_clear_or_a_fault(ending, fault):
    found = verdicts.refusal_faults(ending)
    assert (found == []) if not fault else fault in found[0]


def test_writes_have_labels_by_file_and_kind(space):
    write = os.O_WRONLY | os.O_CREAT
    assert events.label(space, "open", (str(space.out / ".calmotion-x.csv"), "w", write)) == "table: open"
    assert events.label(space, "open", (str(space.out / "calm.csv"), "r", os.O_RDONLY)) is None
    assert events.label(space, "os.rename", ("x", str(space.out / "calm_root.usda"))) == "root layer: rename"
    assert events.label(space, "os.link", ("x", str(space.cache / "meshes" / "k.npz"))) == "meshes: link"
    assert events.label(space, "os.remove", (str(space.root / "elsewhere"),)) is None


@pytest.mark.long
def test_a_short_campaign_is_clean(tmp_path):
    done = subprocess.run([sys.executable, str(HERE / "campaign.py"), "--runs", "10", "--folder", str(tmp_path)])
    assert done.returncode == 0
