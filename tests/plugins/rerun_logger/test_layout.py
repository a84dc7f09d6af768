"""The layout of the recording in the viewer."""

from __future__ import annotations

import synthetic
from recordings import write


def test_the_recording_contains_its_layout(tmp_path):
    from rerun.chunk import RrdReader

    write(tmp_path / "out.rrd", synthetic.result())
    assert len(RrdReader(str(tmp_path / "out.rrd")).blueprints()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["out.rrd"]


def test_each_shot_has_a_layout_of_its_own(tmp_path):
    from rerun.chunk import RrdReader

    names = set()
    for name in ("first", "second"):
        write(tmp_path / f"{name}.rrd", synthetic.result())
        reader = RrdReader(str(tmp_path / f"{name}.rrd"))
        (layout,), (recording,) = reader.blueprints(), reader.recordings()
        assert layout.application_id == recording.application_id
        names.add(layout.application_id)
    assert len(names) == 2, "the viewer keeps one camera for each application"
