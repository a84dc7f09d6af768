"""Recordings written by the plugin, and read back: columns of entities by component."""

from pathlib import Path

import numpy as np
import synthetic
from calmotion.model.run import OutputPaths
from calmotion.testing import host_with, run_operator

PLUGIN = Path(__file__).resolve().parents[3] / "plugins" / "rerun_logger"


def write(path, result, settings=None):
    """Write the recording of a result of the synthetic character; the outputs of the operator."""
    values = [synthetic.character(), synthetic.animation(), result, OutputPaths(rrd=str(path))]
    return run_operator(host_with(PLUGIN), "rerun.log", values, settings)


def tensor_of(cell):
    """The numbers of a tensor as it stands in a column."""
    return cell["buffer"]


def read_recording(path):
    """Component columns by entity and name: (seconds, iterations or None; list of values)."""
    from rerun.chunk import RrdReader

    columns = {}
    for chunk in RrdReader(str(path)).stream():
        table = chunk.to_record_batch()
        names = table.schema.names
        index = next((table.column(names.index(t)) for t in ("time", "iteration") if t in names), None)
        if index is not None:
            kind = str(index.type)
            index = np.array(index.cast("int64")) * (1e-9 if kind.startswith("duration") else 1)
        for name in names:
            if ":" in name:
                columns.setdefault((chunk.entity_path, name), []).append(
                    (index, table.column(names.index(name)).to_pylist())
                )
    merged = {}
    for key, pieces in columns.items():
        times = None if pieces[0][0] is None else np.concatenate([piece[0] for piece in pieces])
        merged[key] = (times, [value for piece in pieces for value in piece[1]])
    return merged
