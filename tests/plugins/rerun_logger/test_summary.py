"""The text of the recording."""

from dataclasses import replace

import numpy as np
import synthetic
from calmotion.model import SearchRecord
from calmotion.model.outputs import SystemModes
from calmotion.model.run import OutputPaths
from calmotion.testing import host_with, run_operator
from recordings import PLUGIN, read_recording, write


def test_the_summary_lists_simplifications_and_errors(columns):
    text = columns["/summary", "TextDocument:text"][1][0][0]
    result = synthetic.result()
    assert "modes above 40 Hz" in text and "0.02 mm" in text
    assert f"{1e3 * result.before.position_errors.max():.2f} mm" in text
    assert f"{1e3 * result.after.position_errors.max():.2f} mm" in text


def test_a_simulation_alone_has_neither_before_nor_after(tmp_path):
    write(tmp_path / "out.rrd", replace(synthetic.result(), after=None, search=SearchRecord()))
    columns = read_recording(tmp_path / "out.rrd")
    text = columns["/summary", "TextDocument:text"][1][0][0]
    assert "| target | largest | rms |" in text and "before" not in text
    names = [str(values[0]) for (_, name), (_, values) in columns.items() if name == "SeriesLines:names"]
    assert any("as animated [mm]" in name for name in names) and not any("before" in name for name in names)


def test_the_summary_names_the_characters_frequencies_where_they_are_known(tmp_path):
    modes = SystemModes(np.array([3.25, 12.5]), np.array([0.01, 0.02]))
    given = [synthetic.character(), synthetic.animation(), synthetic.result(), modes]
    run_operator(host_with(PLUGIN), "rerun.log", [*given, OutputPaths(rrd=str(tmp_path / "out.rrd"))])
    text = read_recording(tmp_path / "out.rrd")["/summary", "TextDocument:text"][1][0][0]
    assert "in its first pose: 3.2, 12.5 Hz" in text
