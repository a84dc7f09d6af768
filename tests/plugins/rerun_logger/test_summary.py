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


def test_the_summary_lists_operators_that_ran_and_that_were_skipped(tmp_path):
    from calmotion.host import OperatorResult, Outcome

    steps = (
        OperatorResult("usd.read", "Read the shot", "usd_reader", Outcome.DONE, duration=1.25, progress=1.0),
        OperatorResult("fe.mesh", "Mesh", "fe_mesher", Outcome.LEFT_OUT, reason="no body is flexible"),
    )
    module = host_with(PLUGIN).plugin("rerun_logger").module
    recording = __import__(f"{module.__name__}.recording", fromlist=["write_recording"])
    path = str(tmp_path / "run.rrd")
    recording.write_recording(path, synthetic.character(), synthetic.animation(), synthetic.result(), operators=steps)
    text = str(
        next(
            value
            for (entity, _), (_, value) in read_recording(path).items()
            if entity == "/summary" and "## Run" in str(value)
        )
    )
    assert "| `usd.read` | usd_reader | done | 1.25 s |  |" in text
    assert "| `fe.mesh` | fe_mesher | left out |  | no body is flexible |" in text
