"""New gains as the pose moves."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
from calmotion.arrays import Array
from calmotion.multibody import SimulationFailure

from .gains import Gains


class Renewal:
    """Gains for the pose of the moment, by a thread beside the ticks or at once.

    Args:
        make: The gains for a pose, shape [M].
        background: Whether by a thread.

    Attributes:
        done, failed: How many were made, and how many could not.
    """

    SAME_POSE = 1e-4  # in which gains stay as they are [rad or m]

    def __init__(self, make: Callable[[Array], Gains], background: bool):
        self._make, self._pool = make, ThreadPoolExecutor(1, "gains") if background else None
        self.done = self.failed = 0
        self._pending: Future[Gains] | None = None
        self._ready: Gains | None = None

    def begin(self, position: Array, gains: Gains) -> None:
        """These gains belong to this pose."""
        if self._pending is not None:
            self._pending.cancel()
        self.done = self.failed = 0
        self._pending, self._ready, self._position = None, None, position

    def ask(self, position: Array) -> None:
        """Gains for a pose are wanted, unless they are those that are used, or others are being made."""
        if self._pending is not None or np.abs(position - self._position).max(initial=0.0) < self.SAME_POSE:
            return
        self._position = position.copy()
        self._pending = Future() if self._pool is None else self._pool.submit(self._make, self._position)
        if self._pool is None:
            try:
                self._pending.set_result(self._make(self._position))
            except Exception as error:
                self._pending.set_exception(error)

    def poll(self) -> Gains | None:
        """New gains, once; None where there are none."""
        if self._pending is None or not self._pending.done():
            return None
        pending, self._pending = self._pending, None
        failure = pending.exception()
        if isinstance(failure, SimulationFailure | ValueError | np.linalg.LinAlgError):
            self.failed += 1
            return None
        self.done += 1
        return pending.result()

    def close(self) -> None:
        """End the thread."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
