"""Caches for tests and measurements."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def fresh_cache() -> Iterator[None]:
    """An empty cache folder for a while, so that results are computed again; it is not for threads."""
    before = os.environ.get("CALMOTION_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["CALMOTION_CACHE"] = folder
        try:
            yield
        finally:
            if before is None:
                del os.environ["CALMOTION_CACHE"]
            else:
                os.environ["CALMOTION_CACHE"] = before
