"""The floors of the package, and the plugins that can be deleted (docs/architecture.md)."""

# From the lowest floor to the highest: a room imports from lower floors only, and nothing of its own floor.
FLOORS = (
    ("arrays", "errors", "public_names", "version"),
    ("support",),
    ("model",),
    ("catalogs", "mesh", "linear_algebra", "views"),
    ("reduction", "rigging"),
    ("multibody", "usd"),
    ("simulation",),
    ("tolerance",),
    ("retargeting",),
    ("host",),
    ("workflow", "testing"),
    ("recordings",),
    ("cli", "pytest_plugin"),
    ("__main__",),
)

# The steps from a shot to its optimised curves and tables: thin operators of the engine. All other plugins can be
# deleted, and the rest works and passes its tests.
REQUIRED_PLUGINS = (
    "body_reduction", "fe_mesher", "model_analysis", "table_writer", "usd_reader", "usd_writer", "vibration_optimizer",
)  # fmt: skip

# A benchmark of what another plugin does is told to need it, where that one is deleted.
MEASURED = {"benchmarks": {"calibration", "diagnosis", "live", "robot_import"}}


def optional_plugins(folder):
    """Names of the plugins in a folder that can be deleted."""
    return sorted({manifest.parent.name for manifest in folder.glob("*/plugin.toml")} - set(REQUIRED_PLUGINS))
