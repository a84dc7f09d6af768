"""Files with commands and motion together, or with a spectrum: datasets of LeRobot, Klipper's tables of resonances."""

import json
from pathlib import Path

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.recordings import ANGLE, Channel, SensorRecording, hash_of

SPECTRUM = "freq,psd_x,psd_y,psd_z"
ACTION, STATE, TIME, EPISODE = "action", "observation.state", "timestamp", "episode_index"


def is_dataset(file: str) -> bool:
    """Whether a file is one of a LeRobot dataset."""
    return file.lower().endswith(".parquet")


def is_spectrum(file: str) -> bool:
    """Whether a file is a table of resonances that Klipper wrote."""
    if not file.lower().endswith(".csv") or not Path(file).is_file():
        return False
    with open(file, encoding="utf-8-sig", errors="replace") as stream:
        return stream.read(200).replace(" ", "").lower().startswith(SPECTRUM)


def read_spectrum(file: str) -> tuple[Array, Array]:
    """Frequencies [Hz] and power of all directions.

    Raises:
        ShotError: It is no table of numbers.
    """
    try:
        rows = np.loadtxt(file, delimiter=",", skiprows=1, usecols=(0, 1, 2, 3), ndmin=2)
    except (OSError, ValueError) as error:
        raise ShotError(
            "the table of resonances cannot be read",
            path=file,
            found=error,
            remedy="Write it with TEST_RESONANCES, columns freq, psd_x, psd_y, psd_z",
        ) from error
    if len(rows) < 8:
        raise ShotError(
            "the table of resonances is too short", path=file, found=f"{len(rows)} rows", remedy="Measure again"
        )
    return rows[:, 0], rows[:, 1:].sum(axis=1)


def read_dataset(file: str) -> tuple[SensorRecording, SensorRecording]:
    """Motion and commands of the first episode of a LeRobot dataset, as a recording each.

    Names of joints are those of `meta/info.json` of the dataset; values are taken as degrees.

    Raises:
        ShotError: pyarrow is not installed, or the file has no actions, states or times.
    """
    try:
        from pyarrow import ArrowException, parquet
    except ImportError as error:
        raise ShotError(
            "reading a LeRobot dataset needs pyarrow, which is not installed",
            path=file,
            remedy='Install it: pip install "pyarrow>=15"',
        ) from error
    try:
        table = parquet.read_table(file)
    except (OSError, ArrowException) as error:
        raise ShotError("the dataset cannot be read", path=file, found=error, remedy="Check the file") from error
    missing = [name for name in (ACTION, STATE, TIME) if name not in table.column_names]
    if missing:
        raise ShotError(
            "the dataset has no such column",
            path=file,
            attribute=missing[0],
            found=", ".join(table.column_names),
            remedy=f"Name a file of data/ with {ACTION}, {STATE} and {TIME}",
        )
    times = np.asarray(table[TIME].to_pylist(), float)
    asked, moved = (np.asarray(table[name].to_pylist(), float) for name in (ACTION, STATE))
    rows = np.ones(len(times), bool)
    notes = [f"{file}: its values are taken as degrees"]
    if EPISODE in table.column_names:
        episodes = np.asarray(table[EPISODE].to_pylist())
        rows = episodes == episodes[0]
        if not rows.all():
            notes.append(f"{file}: of {len(np.unique(episodes))} episodes, the first is read")
    rows[1:] &= np.diff(times) > 0.0
    names, digest = _names(file, moved.shape[1]), hash_of(file)
    found = []
    for values in (moved, asked):
        channels = [
            Channel(ANGLE, name, times[rows] - times[rows][0], np.radians(values[rows, k : k + 1]))
            for k, name in enumerate(names[: values.shape[1]])
        ]
        found.append(SensorRecording(file, digest, tuple(channels), tuple(notes)))
    return found[0], found[1]


def _names(file: str, count: int) -> list[str]:
    """Names of the joints as paths: of the dataset's description, or numbers."""
    for folder in Path(file).resolve().parents:
        info = folder / "meta" / "info.json"
        if info.is_file():
            try:
                names = json.loads(info.read_text(encoding="utf-8"))["features"][STATE]["names"]
            except (OSError, ValueError, KeyError, TypeError):
                break
            names = list(names.values())[0] if isinstance(names, dict) and names else names
            if isinstance(names, list) and len(names) == count:
                return [f"/{str(name).removesuffix('.pos')}" for name in names]
    return [f"/joint_{k + 1}" for k in range(count)]
