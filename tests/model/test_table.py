"""Arrays that are handed out of a result."""

import numpy as np
import pytest
from calmotion.model.table import read_only


def test_a_view_follows_its_array_and_cannot_be_written_to():
    own = np.arange(4.0)
    view = read_only(own[1:])
    own[2] = 7.0
    assert view.tolist() == [1.0, 7.0, 3.0]
    with pytest.raises(ValueError, match="read-only"):
        view[0] = 0.0
