"""One recording for all tests that only read it."""

import pytest
import synthetic
from calmotion.model.outputs import Recording
from recordings import read_recording, write


@pytest.fixture(scope="session")
def columns(tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "out.rrd"
    assert write(path, synthetic.result()) == (Recording(str(path)),)
    return read_recording(path)
