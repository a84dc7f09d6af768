"""The simplifications of a report: a line, or all."""

import math
from collections.abc import Sequence
from typing import Any

from rich.console import Console

from calmotion.cli.tables import about, counted, length, print_table, say
from calmotion.model.limits.kinds import kinds_of_limits


def print_left_out(console: Console, rows: Sequence[dict[str, Any]], whole: bool = True) -> None:
    """The simplifications of the model.

    Args:
        console: Where they are printed.
        rows: Of `left_out`.
        whole: Whether to print all of them, with their reasons and the steps that were not needed; otherwise a line.
    """
    if whole:
        for row in rows:
            error = row["estimated_error_m"]
            cost = "" if error is None else f"; estimated error {about(error)}"
            kind = "skipped" if row["skipped"] else "simplified"
            say(console, f"{kind}: {row['what']} ({row['why']}){cost}")
        return
    made = [row for row in rows if not row["skipped"]]
    if made:
        largest = max(made, key=lambda row: row["estimated_error_m"] or 0.0)
        error = largest["estimated_error_m"]
        cost = f"; largest estimated error {about(error)} ({largest['what']})" if error else ""
        say(console, f"simplified: {counted(len(made), 'part')} of the model{cost}. --verbose lists all")


def print_limits(console: Console, limits: Sequence[dict[str, Any]], optimized: bool) -> None:
    """Limits of motors that are exceeded, or that keep the targets from their motion."""
    rows = []
    for row in limits:
        if not row["exceeded"] and row["cost_m"] is None:
            continue
        limit, before, after = row["shown"]
        verdict = "exceeded" if row["exceeded"] else f"costs {length(row['cost_m'])} rms"
        values = [limit, before, after] if optimized else [limit, after]
        rows.append([row["path"], row["quantity"], *values, f"{row['time_s']:.3f} s", verdict])
    heads = ["limit", "before", "after"] if optimized else ["limit", "reached"]
    print_table(console, "Active limits of motors", ["motor", "quantity", *heads, "at", ""], rows, texts=2)


def print_terms(console: Console, terms: Sequence[dict[str, Any]]) -> None:
    """Residuals and limits of plugins."""
    rows = []
    for row in terms:
        before, after = (f"{row[when]:.4g} {row['unit']}".rstrip() for when in ("before", "after"))
        if row["limit"] is None:
            rows.append([row["name"], row["label"], "", f"{before} rms", f"{after} rms", "", ""])
        else:
            limit, verdict = f"{row['limit']:.4g} {row['unit']}".rstrip(), "exceeded" if row["exceeded"] else "kept"
            rows.append([row["name"], row["label"], limit, before, after, f"{row['time_s']:.3f} s", verdict])
    heads = ["quantity", "of", "limit", "before", "after", "at", ""]
    print_table(console, "Residuals and limits of plugins", heads, rows, texts=2)


def print_tempo(console: Console, tempo: dict[str, Any] | None) -> None:
    """How much slower the animation would have to be for motors to keep their limits on rigid links."""
    if tempo is None:
        return
    if not tempo["possible"]:
        if (weak := tempo["too_weak"]) is not None:
            needed = f"{weak['needed']:.4g} {weak['unit']} at {weak['time_s']:.2f} s, where it has {weak['limit']:.4g}"
            say(console, f"No tempo helps: to hold the weight, {weak['path']} needs {needed} {weak['unit']}.")
        return
    whole, parts = tempo["uniform_added_s"], tempo["least_added_s"]
    stretch = f"{tempo['uniform_stretch']:.0%} of its time ({whole:.2f} s more)"
    say(console, f"On rigid links the whole shot at {stretch} keeps these limits.")
    say(console, f"Slowed down only where it must be, it takes at least {parts:.2f} s more.")


def print_retiming(console: Console, retime: dict[str, Any] | None) -> None:
    """The tempo that was found, and why."""
    if retime is None:
        return
    added, parts = retime["added_s"], retime["stretches"]
    if not parts:
        say(console, "The tempo stays as it is: the animation exceeds no limit that a slower one would keep.")
        return
    longer = f"{added:.2f} s more" if added >= 0.005 else "no more time"
    say(console, f"The performance takes {longer} than the animation.")
    say(console, f"With rigid links, it would take at least {retime['lower_bound_s']:.2f} s more if no part is faster.")
    say(console, f"At one tempo for the whole shot, it would take {retime['uniform_added_s']:.2f} s more.")
    rows = []
    for part in parts:
        reasons = [f"{reason['quantity']} of {reason['path']}" for reason in part["because"]]
        more = f" and {len(reasons) - 2} more" if len(reasons) > 2 else ""
        times = f"{part['from_s']:.2f} to {part['to_s']:.2f} s"
        rows.append([times, f"{part['factor']:.2f}", " and ".join(reasons[:2]) + more])
    print_table(console, "Tempo", ["animation", "times as long", "because of"], rows)
    if retime["lacking_stretch"]:
        more = math.ceil(20.0 * retime["lacking_stretch"]) / 20.0
        say(console, f"some limits need parts that take {more:g} times as long: allow it by --retime slowest={more:g}")
    pins = retime["pins"]
    if pins:
        later = f", {1e3 * pins[0]['shift_s']:.0f} ms later" if pins[0]["shift_s"] > 5e-4 else ""
        say(console, f"kept: {counted(len(pins), 'pinned time')}{later}")


def print_reason(console: Console, report: dict[str, Any]) -> None:
    """Why the curves of `optimize` exceed limits or are worse than the animation, and what to do; else nothing."""
    limits, worse = report["limits"], not report["improved"]
    exceeded = sorted((row for row in limits if row["exceeded"]), key=_excess, reverse=True)
    if exceeded:
        row = exceeded[0]
        limit, _, value = row["shown"]
        if not kinds_of_limits()[row["quantity"]].has_sides:
            limit, value = limit.removeprefix("-"), value.removeprefix("-")
        cost = "follow it less well and " if worse else ""
        more = f", and {len(exceeded) - 1} more" if len(exceeded) > 1 else ""
        broken = f"{row['path']} has {row['quantity']} {value} where {limit} is allowed{more}"
        say(console, f"The new curves {cost}exceed {counted(len(exceeded), 'limit')}: {broken}.")
        names = " and ".join(dict.fromkeys(kinds_of_limits()[row["quantity"]].raised_by for row in exceeded))
        times = ", ".join(dict.fromkeys(f"{row['time_s']:.2f} s" for row in exceeded[:3]))
        say(console, f"Slow the animation down around {times}, or raise {names} if the motors can do more.")
    elif worse and any(row["cost_m"] is not None for row in limits):
        say(console, "The new curves keep limits that the animation exceeds; the table of limits says what each costs.")
        say(console, "Slow the animation down there, or raise these limits, to come nearer to it.")
    elif worse and not report["terms"]:
        how = "was interrupted" if report["interrupted"] else "ended"
        say(console, f"The search {how} before it improved on the animation: keep the shot as it is, or go on.")


def _excess(row: dict[str, Any]) -> float:
    """By how much the new curves exceed a limit, over its size; only limits of positions have sides."""
    limit, value = float(row["limit"]), float(row["after"])
    beyond = abs(value - limit) if kinds_of_limits()[row["quantity"]].has_sides else abs(value) - abs(limit)
    return beyond / max(abs(limit), 1e-12)
