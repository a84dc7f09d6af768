"""Arrays in a page: quantised, as differences, compressed, as text."""

import base64
import gzip
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from calmotion.arrays import Array
from numpy.typing import NDArray

MOST_DIFFERENCES = 2


@dataclass(eq=False)
class Packing:
    """Arrays of 32-bit numbers in one block of bytes; a page finds each by its entry: offset, shape, unit, differences.

    The bytes of equal weight of all numbers of an array lie together, which gzip makes smaller.
    """

    blocks: list[bytes] = field(default_factory=list)
    size: int = 0

    def exact(self, values: Array) -> dict[str, Any]:
        """Add an array as 32-bit floats; its entry."""
        return self._add(np.ascontiguousarray(values, dtype="<f4"), {})

    def rounded(self, values: Array, unit: float) -> dict[str, Any]:
        """Add an array as multiples of a unit, as differences along its last axis where these are smaller; its entry.

        Differences wrap round as 32-bit integers do, and so do their sums: nothing is lost.
        """
        whole = np.rint(np.asarray(values, dtype=float) / unit).astype("<i4")
        forms = [whole]
        for _ in range(MOST_DIFFERENCES if whole.ndim and whole.shape[-1] > MOST_DIFFERENCES else 0):
            forms.append(np.diff(forms[-1], axis=-1, prepend=np.zeros_like(forms[-1][..., :1])))
        sizes = [float(np.log2(1.0 + np.abs(form.astype(float))).sum()) for form in forms]
        order = int(np.argmin(sizes))
        return self._add(forms[order], {"unit": unit, "order": order})

    def _add(self, numbers: NDArray[Any], entry: dict[str, Any]) -> dict[str, Any]:
        block = np.ascontiguousarray(numbers).view(np.uint8).reshape(-1, 4).T.tobytes()
        entry |= {"at": self.size, "shape": list(numbers.shape)}
        self.blocks.append(block)
        self.size += len(block)
        return entry

    def text(self) -> str:
        """All arrays, compressed, in letters; the same arrays give the same text."""
        return base64.b64encode(gzip.compress(b"".join(self.blocks), 9, mtime=0)).decode("ascii")
