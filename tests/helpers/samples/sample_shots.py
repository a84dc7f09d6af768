"""The sample shots: where they are, and what is special about each."""

from pathlib import Path

SAMPLES = Path(__file__).resolve().parents[3] / "samples"

KINDS = {
    "bartender": ("Z", 1.0, "drive", 24.0),
    "dancer": ("Y", 1.0, "bodies", 30.0),
    "rapper": ("Z", 0.01, "drive", 24.0),
    "drummer": ("Z", 1.0, "skeleton", 24.0),
    "boxer": ("Z", 1.0, "drive", 24.0),
    "lamp": ("Z", 1.0, "drive", 24.0),
}
"""Up axis, metres per unit, what animates the motors, and frames per second."""

FIGURE = "figure"
"""The character of two samples, in a layer of its own that nothing animates."""


def path_of(name: str) -> Path:
    """The layer of a sample."""
    return SAMPLES / name / f"{name}.usda"
