"""What a robot stands on, as text: bases that nothing joins to the world, and feet while they are held."""

from collections.abc import Sequence
from typing import Any

from rich.console import Console

from calmotion.cli.tables import length, print_table, say


def print_support(console: Console, reactions: Sequence[dict[str, Any]]) -> None:
    """Whether a base that nothing joins to the world would stand."""
    for row in reactions:
        margin = row["support_margin_m"]
        if margin is None:
            continue
        at = f"at {row['support_time_s']:.3f} s"
        if margin < 0.0:
            say(
                console,
                f"{row['body']} would tip over {at}: nothing joins it to the world, and the centre of pressure is "
                f"{length(-margin)} outside of what it stands on. Hold it by a joint to the world, or move slower",
            )
        else:
            say(console, f"{row['body']} stands: its centre of pressure stays {length(margin)} inside ({at})")


def print_contacts(console: Console, contacts: Sequence[dict[str, Any]]) -> None:
    """The feet while they are held, and what they ask of the ground that no ground does."""
    rows = []
    for row in contacts:
        margin, landing = row["support_margin_m"], row["landing_speed_m_s"]
        rows.append(
            [
                row["path"],
                f"{row['from_s']:.3f} to {row['to_s']:.3f} s",
                f"{row['max_force_n']:.4g} N",
                "" if row["min_normal_force_n"] is None else f"{row['min_normal_force_n']:.4g} N",
                "" if margin is None else length(margin) if margin >= 0.0 else f"-{length(-margin)}",
                "" if row["friction_needed"] is None else f"{row['friction_needed']:.2g}",
                "" if landing is None else f"{1e3 * landing:.3g} mm/s",
            ]
        )
    heads = ["contact", "held", "force", "least normal force", "margin", "friction", "lands with"]
    print_table(console, "Feet on the ground", heads, rows, texts=2)
    for row in contacts:
        for kind in row["unlike_ground"]:
            say(console, _warning(row, kind))


def _warning(row: dict[str, Any], kind: str) -> str:
    """A sentence on what a foot asks of the ground."""
    if kind == "pulls":
        force = f"{-row['min_normal_force_n']:.3g} N"
        return (
            f"{row['path']}: the ground would have to pull with {force} at {row['min_normal_time_s']:.3f} s, which it "
            "cannot. Move slower there, or let the foot go"
        )
    if kind == "tips":
        return (
            f"{row['path']}: the foot would tip over at {row['support_time_s']:.3f} s: the centre of pressure is "
            f"{length(-row['support_margin_m'])} outside of the sole. Shift the weight over it, or move slower"
        )
    return (
        f"{row['path']}: the foot would slip at {row['friction_time_s']:.3f} s: it needs a coefficient of friction of "
        f"{row['friction_needed']:.2g}, and has {row['friction']:.2g}. Move slower there"
    )
