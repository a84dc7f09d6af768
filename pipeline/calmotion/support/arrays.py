"""Arrays that are handed out."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def read_only(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """A view that cannot be written to: what is written of a result later must not differ from its report."""
    view = values.view()
    view.flags.writeable = False
    return view
