"""The floors of the package: a room imports from lower floors only (docs/architecture.md)."""

# From the lowest floor to the highest; rooms of one floor do not know each other.
FLOORS = (
    ("arrays", "errors", "public_names", "version"),
    ("support",),
    ("model",),
    ("mesh", "linear_algebra", "views"),
    ("reduction", "rigging"),
    ("multibody", "usd"),
    ("simulation",),
    ("tolerance",),
    ("retargeting",),
    ("host",),
    ("workflow", "testing"),
    ("recordings",),
    ("cli", "pytest_plugin"),
    ("benchmarks", "__main__"),
)
