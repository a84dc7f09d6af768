"""NPZ of NumPy as a table of a motion."""

from collections.abc import Sequence

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.support import available_memory

from .units import TIME

REMEDY = (
    "Write a column time_s in seconds, and one for each joint, named after it, in rad (or with a comment "
    "'# units: angle deg') or m"
)
_ALL_JOINTS = ("positions", "joint_pos", "dof_positions", "dof_pos")  # the second as of Isaac Lab
_ALL_NAMES = ("joint_names", "dof_names")
_MATRIX = "Name the array of all joints `positions`, and write joint_names, and time_s or fps, beside it"
WITHOUT = "--set motion.read.rate=60Hz --set motion.read.joints=NAME,-,... with a name, or -, for each column"


def read_npz(path: str, names: Sequence[str], left: list[str]) -> tuple[dict[str, Array], dict[str, str], str]:
    """Columns of an NPZ file by name, their units, and that of the other angles.

    There is an array for each joint, or one of all with their names; and `time_s` or `fps`.

    Args:
        left: Receives the names of arrays that are no positions of joints.
    """
    arrays = _arrays(path)
    columns: dict[str, Array] = {}
    unit = str(arrays.pop("units", ""))
    rate = arrays.pop("fps", np.zeros(()))
    fps = float(_numbers(path, "fps", rate.reshape(()) if rate.size == 1 else rate, 0))
    joints = next((name for name in _ALL_JOINTS if name in arrays), None)
    own = next((name for name in _ALL_NAMES if name in arrays), None)
    if joints is not None and (own is not None or names):
        positions = _numbers(path, joints, arrays[joints], 2)
        given = np.atleast_1d(arrays[own]) if own is not None else names
        titles = [name.decode() if isinstance(name, bytes) else str(name) for name in given]
        if positions.shape[1] != len(titles):
            raise ShotError(
                "there must be a name for each column of the positions",
                path=path,
                attribute=joints,
                found=f"shape {positions.shape} and {len(titles)} names",
                remedy=f"Correct {own or 'motion.read.joints'}; - leaves a column out",
            )
        refuse_repeated(path, titles)
        columns = {name: positions[:, k] for k, name in enumerate(titles) if name != "-"}
        columns |= {TIME: _numbers(path, TIME, arrays[TIME], 1)} if TIME in arrays else {}
        left += [name for name in arrays if name not in (joints, own, TIME)]
    else:
        if joints is not None:
            count = arrays[joints].shape[-1] if arrays[joints].ndim == 2 else 0
            raise ShotError(
                "the motion has no names of joints",
                path=path,
                attribute=joints,
                found=f"{count} columns",
                remedy="Write joint_names beside it, or use --set motion.read.joints=NAME,-,... with a name, or -, for "
                "each column",
            )
        columns = {name: _numbers(path, name, array, 1) for name, array in arrays.items()}
    if TIME not in columns and fps > 0.0 and columns:
        columns[TIME] = np.arange(len(next(iter(columns.values())))) / fps
    return columns, {}, "deg" if "deg" in unit.lower() else "rad"


def _arrays(path: str) -> dict[str, np.ndarray]:
    """The arrays of an NPZ file by name, where they fit into the memory.

    Raises:
        ShotError: It is no such file, or too large.
    """
    import zipfile

    try:
        with np.load(path, allow_pickle=False) as content:
            needed, free = float(sum(member.file_size for member in content.zip.infolist())), available_memory()
            if needed > free:
                raise ValueError(f"its arrays take {needed / 1e9:.1f} GB, and {free / 1e9:.1f} GB are free")
            return {name: np.asarray(content[name]) for name in content.files}
    except (ValueError, zipfile.BadZipFile, EOFError, KeyError, AttributeError, MemoryError) as error:
        raise ShotError("this is not an NPZ file of plain arrays", path=path, found=error, remedy=REMEDY) from error


def _numbers(path: str, name: str, array: np.ndarray, axes: int) -> Array:
    """An array as real numbers.

    Raises:
        ShotError: It has another number of axes, or holds anything else.
    """
    if array.ndim != axes or array.dtype.kind not in "iuf":
        wanted = ("one number", "one number for each time", "a number for each time and joint")[axes]
        raise ShotError(
            f"must be {wanted}",
            path=path,
            attribute=name,
            found=f"shape {array.shape} of {array.dtype}",
            remedy=_MATRIX if array.ndim == 2 and axes == 1 else REMEDY,
        )
    return np.asarray(array, np.float64)


def refuse_repeated(path: str, names: Sequence[str]) -> None:
    repeated = next((name for k, name in enumerate(names) if name != "-" and name in names[:k]), None)
    if repeated is not None:
        raise ShotError("two columns have the same name", path=path, found=repeated, remedy="Rename one of them")
