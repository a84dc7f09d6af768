"""How many examples hypothesis draws: a few that are always the same, or, with CALMOTION_HYPOTHESIS=thorough, many new
ones."""

import os

from hypothesis import HealthCheck, Phase, settings
from hypothesis.internal.conjecture import providers

SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
settings.register_profile(
    "few", max_examples=6, derandomize=True, deadline=None, database=None, suppress_health_check=SLOW,
    # a failure is told at once; the thorough run makes it as small as it can, which takes minutes
    phases=(Phase.explicit, Phase.generate),
)  # fmt: skip
settings.register_profile(
    "thorough", max_examples=100, deadline=None, database=None, suppress_health_check=SLOW, print_blob=True
)
PROFILE = os.environ.get("CALMOTION_HYPOTHESIS", "few")
settings.load_profile(PROFILE)
if PROFILE == "few":
    # hypothesis also draws constants of all modules that are loaded, so the examples depended on the tests before
    providers.is_local_module_file = lambda path: False
