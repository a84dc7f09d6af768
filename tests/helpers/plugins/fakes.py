"""Values and operators that tests of the host order and run."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from calmotion.host import Host, Operator, Plugin, PluginState, RunContext
from calmotion.host.discovery import Location


@dataclass(frozen=True)
class Ore:
    amount: int = 1


@dataclass(frozen=True)
class Iron:
    amount: int = 1


@dataclass(frozen=True)
class Coal:
    amount: int = 1


@dataclass(frozen=True)
class Steel:
    amount: int = 1


def operator(
    idname: str, requires=(), provides=(), uses=(), poll=None, execute=None, properties=(), checks=(), check=None
) -> type[Operator]:
    """An operator class; `poll(data)`, `check(context)` and `execute(context)` are functions, by default willing,
    absent and making defaults."""

    def run(self: Operator, context: RunContext) -> Sequence[object]:
        return execute(context) if execute else tuple(kind() for kind in provides)

    return type(
        "Made",
        (Operator,),
        {
            "idname": idname,
            "label": idname.replace(".", " "),
            "requires": tuple(requires),
            "provides": tuple(provides),
            "uses": tuple(uses),
            "properties": tuple(properties),
            "poll": classmethod(lambda cls, data: poll(data) if poll else None),
            "execute": run,
            "checks": tuple(checks),
        }
        | ({"check": lambda self, context: check(context)} if check else {}),
    )


def host_of(*operators: type[Operator]) -> Host:
    """A host with one registered plugin, `smithy`, that holds these operators."""
    host = Host()
    location = Location(Path("smithy"), "test")
    host.plugins.append(Plugin("smithy", location, state=PluginState.REGISTERED, operators=list(operators)))
    return host
