"""Recordings read back: columns of entities by component."""

import numpy as np


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
