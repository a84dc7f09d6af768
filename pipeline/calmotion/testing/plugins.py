"""A host with only the plugins of an author, one of their operators alone, and a check of the rules."""

from collections.abc import Iterable
from pathlib import Path

from calmotion.host import Host, Plugin, PluginError, PluginState, Settings
from calmotion.host.discovery import Location, PluginCommand
from calmotion.host.manifest import FILE_NAME


def host_with(*folders: str | Path) -> Host:
    """A host with only the plugins in these folders.

    Raises:
        PluginError: When one of them does not register; its own exception is the cause.
    """
    host = Host()
    for folder in folders:
        plugin = host.add(Location(Path(folder).resolve(), "test"))
        host.load(plugin)
        if _has_failed(plugin):
            raise PluginError(f"the plugin {plugin.id} failed: {plugin.error}") from plugin.error
    return host


def run_operator(
    host: Host, idname: str, values: Iterable[object], settings: Settings | None = None
) -> tuple[object, ...]:
    """Run one operator on given values.

    Args:
        host: A host with the operator's plugin.
        values: The values it requires, and those it may use.
        settings: Idname -> property -> value.

    Returns:
        The values it provides, in the order of `provides`.

    Raises:
        PluginError: When its poll refuses; the message is the reason.
        Exception: What it raises.
    """
    cls = host.operators[idname]
    # The operator alone: what it uses is given or absent, never made.
    run = Host.run(_only(host, idname), values, cls.provides, settings=settings).finish()
    result = run.results[-1]
    if result.error:
        raise result.error
    if not result.success:
        raise PluginError(result.reason)
    return tuple(run.data[kind] for kind in cls.provides)


def _only(host: Host, idname: str) -> Host:
    owner = host.plugin_of(idname)
    alone = Host()
    alone.plugins = [Plugin(owner.id, owner.location, owner.manifest, owner.state, operators=[host.operators[idname]])]
    return alone


def check_plugin(folder: str | Path) -> list[str]:
    """Check a plugin against the rules.

    Its manifest is valid, what it requires is installed, it registers well-formed operators under names of
    its own, `unregister` removes exactly those, and both can be called again; its commands can be called.

    Returns:
        What is wrong, one sentence each; empty when nothing is.
    """
    folder = Path(folder).resolve()
    if not (folder / FILE_NAME).is_file():
        return [f"the folder holds no {FILE_NAME}"]
    host = Host()
    plugin = host.add(Location(folder, "check"))
    problems: list[str] = []
    names: list[list[str]] = []
    for attempt in ("", " when it is called a second time"):
        host.load(plugin)
        if _has_failed(plugin):
            return [*problems, f"register fails{attempt}: {type(plugin.error).__name__}: {plugin.error}"]
        if not plugin.operators and not (plugin.manifest and plugin.manifest.commands):
            problems.append(f"register adds no operator{attempt}, and the manifest names no command")
        names.append([cls.idname for cls in plugin.operators])
        if not attempt:
            problems += _undocumented(plugin)
        forgotten = host.unload(plugin)
        if _has_failed(plugin):
            return [*problems, f"unregister fails{attempt}: {type(plugin.error).__name__}: {plugin.error}"]
        if forgotten:
            problems.append(f"unregister forgets{attempt}: {', '.join(cls.idname for cls in forgotten)}")
    if names[0] != names[-1]:
        problems.append("register adds other operators when it is called a second time")
    return problems + _faults_of_commands(plugin)


def _faults_of_commands(plugin: Plugin) -> list[str]:
    """What keeps the commands of a plugin from being called."""
    if plugin.manifest is None:
        return []
    problems = []
    for entry in plugin.manifest.commands:
        try:
            PluginCommand(entry, plugin.manifest, plugin.location).load()
        except PluginError as error:
            problems.append(str(error))
    return problems


def _has_failed(plugin: Plugin) -> bool:
    """Whether it failed by now: its state changes as the host loads and unloads it."""
    return plugin.state is PluginState.FAILED


def _undocumented(plugin: Plugin) -> list[str]:
    named = [(f"{cls.idname}.{declared.name}", declared) for cls in plugin.operators for declared in cls.properties]
    return [f"the property {name} has no description" for name, declared in named if not declared.description]
