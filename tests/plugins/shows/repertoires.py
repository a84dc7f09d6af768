"""Members of a repertoire whose transitions all join."""

from calmotion_plugins.shows.sequence.run import Member


def member(name, one, two, **changes):
    """A clip or transition that was searched with success; `changes` are other values of its attributes."""
    values = {
        "seconds": 1.0, "outcome": "done", "error_before_m": 0.02, "error_m": 0.001, "within_tolerance": True,
        "within_goal": True, "exceeded_limits": (), "joined": True, "layer": f"out/{name}.usda",
    }  # fmt: skip
    return Member(name, one, two, **(values | changes))
