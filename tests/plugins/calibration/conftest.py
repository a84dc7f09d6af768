"""The recorded arm, for all tests of calibrations."""

from recorded import recorded_shot, recordings

__all__ = ["recorded_shot", "recordings"]
