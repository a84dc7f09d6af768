"""Options of a search that may change the tempo: how much, and what stays on its beat."""

import argparse
import csv

PIN_COLUMNS = ("time_code", "time_s")  # of a file of pinned times


def retime_options(command: argparse.ArgumentParser) -> None:
    """Add them to a command."""
    group = command.add_argument_group(
        "tempo", "Slow parts down where motors cannot follow: calm:retime:slowest, :fastest and :pinned."
    )
    group.add_argument(
        "--retime", metavar="slowest=2,fastest=1,pin=24,48", nargs="?", const={}, type=_tempo,
        help="change the tempo where limits of motors ask for it: largest and smallest stretch, and time codes (or "
        "seconds, with an s) whose distances stay as they are",
    )  # fmt: skip
    group.add_argument(
        "--pin",
        metavar="FILE",
        type=_pins,
        help=f"CSV file of such times, in its column {' or '.join(PIN_COLUMNS)}, or its only column of time codes",
    )
    group.add_argument(
        "--retime-scene",
        choices=("yes", "no"),
        help="whether cameras, props and sounds follow the tempo (default: yes)",
    )


def retime_settings(args: argparse.Namespace) -> dict[str, object]:
    """The settings of the search that these options mean."""
    given: dict[str, object] | None = getattr(args, "retime", None)
    if given is None:
        return {}
    pinned = [str(text) for text in (given.get("pinned", ""), args.pin or "") if text]
    return {"retime": True} | given | ({"pinned": ",".join(pinned)} if pinned else {})


def refuse_unused_retiming(args: argparse.Namespace) -> None:
    """Refuse options of the tempo where it stays as it is."""
    from calmotion.host import SettingError

    if args.retime is not None or any(text.startswith("retarget.optimize.retime=") for text in args.set):
        return
    for option, value in (("--pin", args.pin), ("--retime-scene", args.retime_scene)):
        if value is not None:
            raise SettingError("the tempo stays as it is", path=option, remedy=f"Add --retime, or leave {option} out.")


def _tempo(text: str) -> dict[str, object]:
    """`slowest=1.5,fastest=0.9,pin=24,48,72` as settings."""
    found: dict[str, object] = {}
    pins: list[str] = []
    name = ""
    for part in filter(None, text.split(",")):
        key, equals, value = part.partition("=")
        if equals:
            name = key.strip()
        elif name != "pin":
            raise argparse.ArgumentTypeError(f"{part} has no name; write slowest=1.5,fastest=0.9,pin=24,48,72")
        if name == "pin":
            pins.append(value if equals else part)
        elif name in ("slowest", "fastest"):
            found[name] = _number(value)
        else:
            raise argparse.ArgumentTypeError(f"{name} is none of slowest, fastest, pin")
    return found | ({"pinned": ",".join(pins)} if pins else {})


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} is not a number") from None


def _pins(path: str) -> str:
    """The times in a file, as settings have them."""
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            rows = [row for row in csv.reader(file) if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise argparse.ArgumentTypeError(f"{path} cannot be read: {reason}") from None
    head = [cell.strip() for cell in rows[0]] if rows else []
    known = [name for name in PIN_COLUMNS if name in head]
    if not known and len(head) != 1:
        raise argparse.ArgumentTypeError(f"{path} has no column {' or '.join(PIN_COLUMNS)}; its first row is {head}")
    column, unit = (head.index(known[0]), "s" * (known[0] == "time_s")) if known else (0, "")
    cells = [row[column].strip() for row in (rows[1:] if known else rows) if len(row) > column]
    return ",".join(f"{_number(cell):.17g}{unit}" for cell in cells)
