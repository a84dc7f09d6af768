"""The layout of the recording in the viewer."""

import colorsys

import synthetic
from calmotion_plugins.rerun_logger import colors
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


def test_curves_of_motors_differ_in_hue_and_can_be_read_on_both_themes():
    style = colors.Style((0, 114, 178), 1.0, "after")
    found = [style.shade(k, 5, spread=0.85) for k in range(5)]
    hues = sorted(colorsys.rgb_to_hls(*(c / 255.0 for c in color))[0] for color in found)
    assert min(b - a for a, b in zip(hues, hues[1:], strict=False)) > 0.15
    for color in found:
        assert colors.DARKEST - 0.01 <= colors.luminance(color) <= colors.BRIGHTEST + 0.01
